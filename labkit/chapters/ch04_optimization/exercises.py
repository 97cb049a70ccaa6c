"""Chapter 4: gradient, Hessian, and the steps of Newton, Gauss-Newton and the trust region."""

import functools
import math

import numpy as np
from scipy.optimize import brentq

from ...documents.thesis import wells
from ...estimation import convexity
from ...estimation import optimization as opt
from ...exercises import metrics
from ...exercises.engine import Chapter, Exercise, Prediction
from ...exercises.outcome import Mistake
from ...exercises.value import Value
from . import beyond


def place(rng, within=3.0):
    """A point around the two wells."""
    return (rng.uniform(-within, within, 2),)


def in_a_well(rng):
    """A place a little beside the center of the deeper well: there a forward difference errs most, for its slope."""
    return (wells.CENTERS[1] + 1e-3 * rng.normal(size=2),)


def on_the_flank(rng):
    """A place beside the deeper well, along an axis, where f is steep and its curvature changes fast."""
    return (wells.CENTERS[1] + rng.choice([-1, 1]) * rng.uniform(0.32, 0.35) * np.eye(2)[rng.integers(2)],)


def far_out(rng):
    """A place far out on the plain."""
    return (rng.choice([-1, 1], 2) * rng.uniform(80, 150, 2),)


def at_a_center(rng, which):
    """The center of a well, to the last bit, where x - c has no direction."""
    return (wells.CENTERS[which].copy(),)


def straight_beside(rng, which, axis, away):
    """A place beside the center of a well, along an axis: the other offset is 0."""
    return (wells.CENTERS[which] + rng.choice([-1, 1]) * rng.uniform(*away) * np.eye(2)[axis],)


PLACES = (place, functools.partial(place, within=30.0), place, in_a_well)
BESIDE = tuple(  # close to the shallower well, and where the deeper one is steepest, among others
    functools.partial(straight_beside, which=which, axis=axis, away=away)
    for which, axis, away in ((0, 0, (0.05, 0.15)), (0, 1, (0.5, 1.5)), (1, 0, (0.54, 0.62)), (1, 1, (0.05, 0.15)))
)
TWO = "the surface has two unknowns, so that it can be drawn"


def at_the_origin(rng):
    """Between the wells, where x itself is 0."""
    return (np.zeros(2),)


def special_places(tol):
    """Special draws at both centers and at the origin, on a flank, and far out, where everything is small."""
    words = "right, but not at the center of a well:"
    return [
        *((functools.partial(at_a_center, which=k), metrics.Numbers(tol), words) for k in range(2)),
        (at_the_origin, metrics.Numbers(tol), "right, but not at the origin:"),
        (on_the_flank, metrics.Numbers(tol), "right, but not on the flank of the deeper well, where f is steep:"),
        *((draw, metrics.Numbers(tol), "right, but not straight beside the center of a well:") for draw in BESIDE),
        (far_out, metrics.Numbers(1e-3, least=0.0), "right, but not far out on the plain, where f is nearly flat:"),
    ]


BESIDE_THE_CENTER = (
    in_a_well,
    metrics.Numbers(4e-7),
    "right to some digits, but not accurate enough close beside the center of the deeper well:",
)


def turned(eigenvalues, angle):
    """Symmetric 2x2 matrix with these eigenvalues, its axes turned by the angle."""
    c, s = np.cos(angle), np.sin(angle)
    V = np.array([[c, -s], [s, c]])
    return V @ np.diag(eigenvalues) @ V.T


def classify_extremum(g, H):
    """Kind of a point by the rule that the notebook states: |g| against 1e-6, then the eigenvalues of H."""
    if math.hypot(*g) > 1e-6:  # to the last bit, on any processor
        return "not stationary"
    return _by(np.linalg.eigvalsh)(H)


def kind_of_point(rng, bends, length, signs=(1, -3), angle_deg=(30, 60), between=(0.9, 1.1), size=1.0, flatter=1.0):
    """Gradient of this length and Hessian that bends up (1) or down (-1) a little and much along two turned axes; by
    `flatter` less still along the first.
    """
    eigenvalues = size * np.array([flatter * rng.uniform(0.5, 1.0), rng.uniform(4.0, 8.0)]) * bends
    g = rng.uniform(*between, 2) * signs
    return rng.uniform(*length) * g / np.linalg.norm(g), turned(eigenvalues, np.deg2rad(rng.uniform(*angle_deg)))


BOWL, DOME, SADDLE, DEEP_SADDLE = (1, 1), (-1, -1), (-1, 1), (1, -1)
VANISHED, STEEP = (5e-8, 2e-7), (0.5, 3.0)  # |g|: as after an iteration, and as anywhere
KINDS = (
    *(functools.partial(kind_of_point, bends=bends, length=VANISHED) for bends in (BOWL, DOME)),
    *(  # the larger entry on the diagonal comes second, then first: the eigenvalues of `np.linalg.eig` with it
        functools.partial(kind_of_point, bends=bends, length=VANISHED, angle_deg=(30, 43))
        for bends in (SADDLE, DEEP_SADDLE)
    ),
    functools.partial(kind_of_point, bends=SADDLE, length=VANISHED, angle_deg=(2, 8)),  # its diagonal is mixed
    *(  # the other sign beside the diagonal
        functools.partial(kind_of_point, bends=bends, length=VANISHED, angle_deg=(-60, -30))
        for bends in (BOWL, DOME, SADDLE)
    ),
    *(functools.partial(kind_of_point, bends=BOWL, length=STEEP, signs=s) for s in ((-1, -1), (1, -3), (1, 1))),
    *(functools.partial(kind_of_point, bends=bends, length=STEEP) for bends in (DOME, SADDLE, DEEP_SADDLE)),
    functools.partial(
        kind_of_point, bends=BOWL, length=(8.5e-7, 9.5e-7)
    ),  # below the limit, the sum of both entries not
    functools.partial(kind_of_point, bends=BOWL, length=(8.5e-7, 9.5e-7), signs=(0, 1)),  # and here the sum as well
    functools.partial(kind_of_point, bends=BOWL, length=(1.1e-6, 1.2e-6), signs=(1, -1)),  # each entry is below it
    *(  # the limit is one for all kinds
        functools.partial(kind_of_point, bends=bends, length=l)
        for bends in (DOME, SADDLE)
        for l in ((8.5e-7, 9.5e-7), (1.2e-6, 2e-6), (2e-4, 5e-4))
    ),
    *(functools.partial(kind_of_point, bends=BOWL, length=l) for l in ((2e-6, 5e-6), (2e-5, 5e-5), (2e-4, 5e-4))),
    functools.partial(kind_of_point, bends=BOWL, length=(2e-3, 5e-3)),
    functools.partial(kind_of_point, bends=BOWL, length=STEEP, signs=(1, -1), between=(1, 1)),  # its entries cancel
    *(  # along one axis, then along the other: a rule that reads one entry alone is not one that asks for both
        functools.partial(kind_of_point, bends=BOWL, length=STEEP, signs=s) for s in ((0, 1), (1, 0))
    ),
    *(  # faintly bent, as out on the plain, and sharply
        functools.partial(kind_of_point, bends=bends, length=(0, 1e-8), size=size)
        for bends, size in ((BOWL, 1e-7), (DOME, 1e-7), (SADDLE, 1e-7), (DOME, 1e4), (DEEP_SADDLE, 1e4))
    ),
)


def gradient_at_the_limit(rng):
    """A gradient exactly as long as one that still counts as 0, along an axis, so that rounding has no part in it; none
    at all where NumPy's norm rounds even that.
    """
    g = 1e-6 * rng.choice([-1, 1]) * np.eye(2)[rng.integers(2)]
    return g * (np.linalg.norm(g) == 1e-6), kind_of_point(rng, BOWL, STEEP)[1]


def exactly_stationary(rng, bends, size=1.0):
    """No gradient at all, and a Hessian without mixed derivatives that bends so."""
    return np.zeros(2), size * np.diag(bends * rng.uniform(0.5, 8, 2))


def as_round(rng, sign):
    """No gradient, and the same curvature in all directions."""
    return np.zeros(2), sign * rng.uniform(1, 5) * np.eye(2)


STATIONARY = (
    *(
        (functools.partial(exactly_stationary, bends=bends), "right, but not where g is exactly 0 and H is diagonal:")
        for bends in (BOWL, DOME, SADDLE)
    ),
    *(
        (functools.partial(as_round, sign=sign), "right, but not where f bends alike in all directions:")
        for sign in (1, -1)
    ),
    *(
        (
            functools.partial(kind_of_point, bends=bends, length=(0, 1e-14), size=1e-12),
            "right, but not where f bends by some 1e-12 only. No eigenvalue is 0, and the sign of each tells:",
        )
        for bends in (BOWL, DOME, SADDLE)
    ),
    *(
        (
            functools.partial(kind_of_point, bends=bends, length=VANISHED, flatter=1e-6, angle_deg=angle_deg),
            "right, but not where f bends a million times less one way than the other. No eigenvalue is 0, and the sign of "
            "each tells:",
        )
        for bends, angle_deg in ((BOWL, (30, 60)), (DOME, (-60, -30)), (SADDLE, (-60, -30)), (DEEP_SADDLE, (30, 60)))
    ),
)


def gradient_and_hessian(rng, signs):
    """A gradient and a Hessian with eigenvalues of these signs, far from singular."""
    eigenvalues = rng.uniform(1, 6, 2) * signs
    return rng.normal(scale=5, size=2), turned(eigenvalues, rng.uniform(0.3, 1.2))


def diagonal_model(rng):
    """A gradient and a Hessian without mixed derivatives."""
    return rng.normal(scale=5, size=2), np.diag(rng.uniform(1, 6, 2) * rng.choice([-1, 1], 2))


def faint_model(rng):
    """A gradient and a Hessian as far out on the plain."""
    g, H = gradient_and_hessian(rng, rng.choice([-1, 1], 2))
    return 1e-10 * g, 1e-10 * H


def long_step(rng):
    """A model so flat that Newton's step is some ten million long."""
    g, H = gradient_and_hessian(rng, rng.choice([-1, 1], 2))
    return g, 1e-7 * H


def no_curvature_along(rng, k):
    """A saddle that does not bend along one of the two axes: nothing can be divided by that entry of H."""
    H = np.full((2, 2), rng.choice([-1, 1]) * rng.uniform(1, 5))
    H[k, k], H[1 - k, 1 - k] = 0.0, rng.choice([-1, 1]) * rng.uniform(1, 5)
    return rng.normal(scale=5, size=2), H


def there_already(rng):
    """A stationary point, from which Newton does not move."""
    return np.zeros(2), gradient_and_hessian(rng, (1, -1))[1]


def valley(rng):
    """A gradient and the Hessian of a narrow valley."""
    return rng.normal(scale=5, size=2), turned((rng.uniform(1, 6), 1e6 * rng.uniform(1, 6)), rng.uniform(0.3, 1.2))


MODELS = tuple(functools.partial(gradient_and_hessian, signs=s) for s in ((1, 1), (-1, 1), (-1, -1), (1, -1)))


def residual_and_jacobian(rng, m, n):
    """m residuals of n unknowns, and a Jacobian far from singular."""
    columns, axes = (np.linalg.qr(rng.normal(size=(k, n)))[0] for k in (m, n))
    return rng.normal(scale=3, size=m), columns * rng.uniform(1, 4, n) @ axes.T


SIZES = ((6, 2), (7, 3), (4, 1), (3, 3), (9, 5))


def damped_case(rng, m, n, damping):
    """Residuals, Jacobian and a damping around this one; 0 is Gauss and Newton's step."""
    return *residual_and_jacobian(rng, m, n), float(damping * rng.uniform(0.6, 1.4))


def faint_jacobian(rng):
    """Residuals that hardly change with the unknowns, and a damping as small as their squares."""
    r, J, damping = damped_case(rng, 7, 3, 4.0)
    return 1e-3 * r, 1e-3 * J, 1e-6 * damping


def columns_alike(rng):
    """A Jacobian one column of which is made of the others: without damping many steps would be as good, with it one is
    best.
    """
    r, J, damping = damped_case(rng, 7, 3, 2.0)
    J[:, rng.integers(3)] = 0
    return r, J @ np.linalg.qr(rng.normal(size=(3, 3)))[0], damping


def narrow_valley(rng):
    """No damping, and unknowns of which one combination hardly moves the residuals, by a ten thousandth."""
    columns, axes = (np.linalg.qr(rng.normal(size=(k, 3)))[0] for k in (7, 3))
    return rng.normal(scale=3, size=7), columns * rng.permutation([1e-4, 0.5, 1.0]) @ axes.T, 0.0


DAMPED = tuple(  # 0 in a size that is damped as well: what tells them apart is the damping, not the shape
    functools.partial(damped_case, m=m, n=n, damping=d)
    for m, n, d in ((6, 2, 0.5), (7, 3, 8.0), (4, 1, 4.0), (7, 3, 0.0), (9, 5, 60.0))
)


def tried_step(rng, shares):
    """Cost before and after a step that kept a share between these of its promise, with the model's g and B.

    It goes downhill, yet not straight down; a cost may be negative, as that of a well is, and a model bend down.
    """
    curvatures = rng.uniform(1, 4, 2) * rng.choice(((1, 1), (1, -1)))
    g, B = rng.normal(scale=3, size=2), turned(curvatures, rng.uniform(0.3, 1.2))
    aside = rng.choice([-1, 1]) * rng.uniform(0.3, 0.8)
    step = -rng.uniform(0.08, 0.2) * (g + aside * np.array([-g[1], g[0]]))
    cost = rng.choice([-1, 1]) * rng.uniform(5, 20)
    return cost, cost - rng.uniform(*shares) * opt.predicted_decrease(g, B, step), g, B, step


def uphill_promise(rng):
    """A step along which the model itself rises, as a careless one may: the cost rises with it, or falls all the same."""
    cost, _, g, B, step = tried_step(rng, (0.2, 1.2))
    return cost, cost - rng.choice([-1, 1]) * rng.uniform(1, 5), g, B, -step


def faint_step(rng):
    """A step near the end of a run, where costs change in their last digits."""
    cost, new_cost, g, B, step = tried_step(rng, (0.2, 1.2))
    return 0.0, 1e-12 * (new_cost - cost), 1e-6 * g, B, 1e-6 * step


def nothing_brought(rng):
    """A step that leaves the cost where it was."""
    cost, _, g, B, step = tried_step(rng, (0.2, 1.2))
    return cost, cost, g, B, step


def costly_step(rng):
    """A step between costs in the millions."""
    cost, new_cost, g, B, step = tried_step(rng, (0.2, 1.2))
    return 1e6 * cost, 1e6 * new_cost, 1e6 * g, 1e6 * B, step


def from_a_stationary_place(rng):
    """A step from where g is 0: the model promises what its curvature alone does."""
    cost, new_cost, _, B, step = tried_step(rng, (0.2, 1.2))
    return cost, new_cost, np.zeros(2), B, step


SPECIAL_STEPS = (
    (uphill_promise, "right, but not for a step for which the model promises a rise:"),
    (faint_step, "right, but not for a very short step, where all decreases are tiny:"),
    (
        functools.partial(tried_step, shares=(12, 40)),
        "right, but not for a step that brings more than ten times what was promised:",
    ),
    (
        functools.partial(tried_step, shares=(-40, -12)),
        "right, but not for a step that raises the cost by more than ten times of what it was promised to fall:",
    ),
    (nothing_brought, "right, but not for a step that leaves the cost as it was:"),
    (costly_step, "right, but not where costs are in the millions:"),
    (from_a_stationary_place, "right, but not for a step from where g is 0:"),
)
TRIED_STEPS = tuple(functools.partial(tried_step, shares=s) for s in ((0.2, 1.2), (-0.8, -0.2)))


def dogleg_case(rng, between, length):
    """Gradient, positive definite curvature and a radius, `between` the corner (at 0) and the Newton point (at 1)."""
    angle = rng.uniform(-np.pi, np.pi)
    across = angle + np.deg2rad(rng.uniform(30, 60))  # along an axis of B the path has no bend
    B = turned((rng.uniform(0.4, 0.8), rng.uniform(3, 5)), angle)
    g = rng.uniform(*length) * np.array([np.cos(across), np.sin(across)])
    return g, B, _radius_between(g, B, rng.uniform(*between))


def _radius_between(g, B, share):
    """The radius at a share of the way from the corner to the Newton point, in length; below 0 within the corner's."""
    corner = np.linalg.norm(opt.cauchy_step(g, B, 1e9))
    full = np.linalg.norm(opt.newton_step(g, B))
    return float((1 + share) * corner if share < 0 else corner + share * (full - corner))


def scaled_dogleg(rng, size):
    """A dogleg on its second leg, of another size as a whole."""
    g, B, radius = dogleg_case(rng, (0.2, 0.8), (15, 40))
    return size * g, B, size * radius


def dogleg_along(rng, of):
    """A dogleg on its second leg of which the gradient ("g") or the axes of the curvature ("B") lie along the axes."""
    curvatures, angle = (rng.uniform(0.4, 0.8), rng.uniform(3, 5)), np.deg2rad(rng.uniform(30, 60))
    if of == "g":
        g, B = rng.choice([-1, 1]) * rng.uniform(15, 40) * np.eye(2)[rng.integers(2)], turned(curvatures, angle)
    else:
        g = rng.uniform(15, 40) * rng.choice([-1, 1], 2) * np.array([np.cos(angle), np.sin(angle)])
        B = np.diag(rng.permutation(curvatures))
    return g, B, _radius_between(g, B, rng.uniform(0.2, 0.8))


def dogleg_at_rest(rng):
    """A stationary point, from which the path does not set out."""
    _, B, radius = dogleg_case(rng, (0.2, 0.8), (15, 40))
    return np.zeros(2), B, radius


def close_to_the_rim(rng, step, share):
    """A dogleg whose Newton point, or corner, lies at this share of the radius."""
    g, B, _ = dogleg_case(rng, (0.2, 0.8), (15, 40))
    return g, B, float(np.linalg.norm(step(g, B)) / rng.uniform(*share))


JUST_WITHIN, JUST_OUTSIDE = (0.995, 0.999), (1.001, 1.005)


def dogleg_in_a_long_valley(rng):
    """A dogleg on its second leg in a valley ten thousand times as flat along as across."""
    angle = rng.uniform(-np.pi, np.pi)
    across = angle + np.deg2rad(rng.uniform(30, 60))
    B, g = turned((rng.uniform(4e-4, 8e-4), rng.uniform(4, 8)), angle), np.array([np.cos(across), np.sin(across)])
    return g, B, _radius_between(g, B, rng.uniform(0.2, 0.8))


SPECIAL_DOGLEGS = (
    (
        dogleg_in_a_long_valley,
        "right, but not where B is thousands of times as small along one direction as along another:",
    ),
    (functools.partial(scaled_dogleg, size=1e-6), "right, but not for a radius near 1e-5:"),
    (functools.partial(scaled_dogleg, size=1e4), "right, but not for a radius in the ten thousands:"),
    (functools.partial(dogleg_along, of="B"), "right, but not where B is diagonal:"),
    (functools.partial(dogleg_along, of="g"), "right, but not where g lies along an axis:"),
    (dogleg_at_rest, "right, but not where g is 0 and the step with it:"),
)


def beyond_the_gradient(rng, length):
    """A dogleg on its second leg whose radius is longer than g: who takes −g for the corner is inside as well."""
    while True:
        g, B, radius = dogleg_case(rng, (0.7, 0.9), length)
        if np.linalg.norm(g) < 0.9 * radius:
            return g, B, radius


DOGLEG_CASES = tuple(
    case
    for length in ((15, 40), (0.01, 0.05))  # squares of lengths are larger, then smaller than the lengths
    for case in (
        *(
            functools.partial(dogleg_case, between=between, length=length)
            for between in ((-0.7, -0.2), (0.2, 0.8), (1.3, 2.0))
        ),
        functools.partial(beyond_the_gradient, length=length),
    )
)


def beside_the_rim(rng, step):
    """A dogleg whose Newton point, or corner, lies on a diagonal, outside the circle and inside the square about it."""
    while True:
        g, B, _ = dogleg_case(rng, (0.2, 0.8), (15, 40))
        x, y = step(g, B)
        turn = rng.integers(4) * np.pi / 2 + np.pi / 4 - np.arctan2(y, x)
        Q = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        g, B, radius = Q @ g, Q @ B @ Q.T, float(rng.uniform(0.75, 0.95) * np.hypot(x, y))
        if step is not opt.newton_step or np.linalg.norm(opt.cauchy_step(g, B, 1e9)) < 0.9 * radius:
            return g, B, radius


def _corner(g, B):
    return opt.cauchy_step(g, B, 1e9)


BESIDE_THE_RIM = (
    *(
        (
            functools.partial(beside_the_rim, step=step),
            f"right, but not where the {name} lies outside the radius by little:",
        )
        for step, name in ((opt.newton_step, "Newton point"), (_corner, "corner"))
    ),
    *(
        (
            functools.partial(close_to_the_rim, step=step, share=share),
            f"right, but not where the {name} lies {where} the radius by a thousandth or a few:",
        )
        for step, name in ((opt.newton_step, "Newton point"), (_corner, "corner"))
        for share, where in ((JUST_WITHIN, "within"), (JUST_OUTSIDE, "outside"))
    ),
)
ITERATE = metrics.Several(metrics.Numbers(1e-7), metrics.Numbers(1e-7), names=("x", "radius"), together=True)
ITERATE_OF_ANY_SIZE = metrics.Several(*2 * (metrics.Numbers(1e-6, least=0.0),), names=("x", "radius"), together=True)


def straight_path(rng, share):
    """A curvature alike in all directions: the corner is the Newton point, and no second leg is left."""
    g, curvature = rng.normal(scale=5, size=2), rng.uniform(0.5, 3)
    return g, curvature * np.eye(2), float(share * np.linalg.norm(g) / curvature)


# Wrong variants --------------------------------------------------------------------------------------------------------------------------


def _terms(x, first=(1.0, 1.0), second=(-1.0, -2.0), one=1.0):
    d = x - np.array([first, second])
    return d, (d * d).sum(-1) + one


def _gradient(power=2, depths=wells.DEPTHS, **changes):
    def variant(x):
        d, q = _terms(x, **changes)
        return (2 * np.array(depths) / q**power) @ d

    return variant


def _gradient_with_one_q(k):
    """With the q of well k for both wells."""

    def variant(x):
        d, q = _terms(x)
        return (2 * wells.DEPTHS / q[k] ** 2) @ d

    return variant


def _factors(x):
    """What multiplies x - c of each well in the gradient."""
    return 2 * wells.DEPTHS / _terms(x)[1] ** 2


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


def _one_well_alone(derivative, name):
    """Mistakes of who lets one well count at each place, and the other one elsewhere."""
    sides = {
        "nearer": lambda x: _terms(x)[1],
        "steeper": lambda x: -_factors(x) * np.sqrt(_terms(x)[1] - 1),
    }
    text = "At each place one well alone counts here, the {} one. Both count everywhere: add them up."

    def variant(size):
        return lambda x: derivative(depths=wells.DEPTHS * np.eye(2)[np.argmin(size(x))])(x)

    return [Mistake(variant(size), text.format(side), id=f"{name}-{side}-well") for side, size in sides.items()]


UNIT = np.eye(2)


def _hessian_with(unit=UNIT, product=np.outer, wells_seen=(0, 1)):
    """The sum over the wells with other things than I and the outer product."""

    def variant(x):
        d, q = _terms(x)
        w = wells.DEPTHS
        terms = [2 * w[k] / q[k] ** 2 * unit - 8 * w[k] / q[k] ** 3 * product(d[k], d[k]) for k in wells_seen]
        return sum(terms, np.zeros((2, 2)))

    return variant


def _jacobian(less, depths=wells.DEPTHS):
    """The blocks √(w/q) (I - less), with something else than the outer product over q."""

    def variant(x):
        d, q = _terms(x)
        return np.vstack([np.sqrt(depths[k] / q[k]) * (np.eye(2) - less(d[k], q[k])) for k in range(2)])

    return variant


def _jacobian_with(x, factor=lambda w, q: np.sqrt(w / q), product=lambda d: np.outer(d, d), depths=wells.DEPTHS):
    """The Jacobian with another factor, product or depths."""
    blocks = []
    for w, c in zip(depths, wells.CENTERS):
        d = x - c
        q = d @ d + 1
        blocks.append(factor(w, q) * (np.eye(2) - product(d) / q))
    return np.vstack(blocks)


def _diagonal_only(x):
    return np.diag(np.diag(wells.hessian(x)))


def _stationary(kind, moves=lambda g: np.linalg.norm(g) > 1e-6):
    def variant(g, H):
        return "not stationary" if moves(g) else kind(H)

    return variant


def _by(signs):
    """Kind by the signs of some numbers."""
    return lambda H: "minimum" if (signs(H) > 0).all() else "maximum" if (signs(H) < 0).all() else "saddle"


def _kind_before_slope(early):
    """The words `early` are handed out before the gradient has been looked at."""

    def variant(g, H):
        kind = _by(np.linalg.eigvalsh)(H)
        return kind if kind in early else classify_extremum(g, H)

    return variant


def _second_order_only(g, H):
    return _by(np.linalg.eigvalsh)(H)


def _first_order_only(g, H):
    return "not stationary" if np.linalg.norm(g) > 1e-6 else "minimum"


def _swapped(g, H):
    kind = classify_extremum(g, H)
    return {"minimum": "maximum", "maximum": "minimum"}.get(kind, kind)


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


def _leg_by_shares(g, B, radius):
    """In the second leg: its share as if the length grew evenly along it."""
    full, corner = opt.newton_step(g, B), opt.cauchy_step(g, B, 1e9)
    length, whole = np.linalg.norm(corner), np.linalg.norm(full)
    if not length < radius < whole:
        return opt.dogleg_step(g, B, radius)
    return corner + (radius - length) / (whole - length) * (full - corner)


def _lowest_within(g, B, radius):
    """The lowest point of the model within the radius, by damping."""
    step, low, high = opt.newton_step(g, B), 0.0, np.linalg.norm(g) / radius
    if np.linalg.norm(step) <= radius:
        return step
    for _ in range(60):
        middle = (low + high) / 2
        step = np.linalg.solve(B + middle * np.eye(len(g)), -g)
        low, high = (middle, high) if np.linalg.norm(step) > radius else (low, middle)
    return step


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


def _wrong_comparison(g, B, radius):
    """The square of the Newton step's length compared with the radius."""
    full = opt.newton_step(g, B)
    return full if full @ full <= radius else _past_newton(g, B, radius)


def _corner_or_newton(g, B, radius):
    """Never on the second leg: the corner, or the rim before it, until the Newton point lies inside."""
    full, corner = opt.newton_step(g, B), opt.cauchy_step(g, B, radius)
    return full if np.linalg.norm(full) <= radius else corner


def _dogleg(
    corner=lambda p: p,
    full=lambda n: n,
    rim=None,
    share=lambda a, b, c: (-b + np.sqrt(b * b - a * c)) / a,
    leg=None,
    rim_term=np.square,
):
    """The whole path, one of its parts replaced: corner, Newton point, step to the rim, share of the leg, leg, radius²."""

    def variant(g, B, radius):
        n, p = full(opt.newton_step(g, B)), corner(-(g @ g) / (g @ B @ g) * g)
        if np.linalg.norm(n) <= radius:
            return n
        if np.linalg.norm(p) >= radius:
            return rim(g, p, radius) if rim else -radius * g / np.linalg.norm(g)
        way = leg(n, p) if leg else n - p
        return p + share(way @ way, p @ way, p @ p - rim_term(radius)) * way

    return variant


def _differences(function, h, behind):
    """The derivative by differences of a wide step, from a place `behind` steps back."""
    return lambda x: np.stack(
        [(function(x + e) - function(x - behind * e)) / ((1 + behind) * h) for e in h * np.eye(2)], axis=-1
    )


def _twice_ahead(h):
    """The second derivatives by differences of f itself, all steps ahead."""

    def variant(x):
        e, f = h * np.eye(2), wells.value
        return np.array([[(f(x + a + b) - f(x + a) - f(x + b) + f(x)) / h**2 for b in e] for a in e])

    return variant


def _wide_differences(name, function, forward_steps, central_steps):
    """Mistakes of who takes differences, forward or with a wide step; smaller steps are within the tolerance."""
    forward = (
        "These are forward differences: they are off by about ½h times the next derivative. Differentiate by hand, or step "
        "to both sides, from x − h e to x + h e, with h = 1e-5."
    )
    central = (
        "These are central differences with so wide a step that it shows: they are off by about h²/6 times the third "
        "derivative. Differentiate by hand, or take h = 1e-5."
    )
    kinds = ((0, forward, forward_steps), (1, central, central_steps))
    return [
        Mistake(_differences(function, h, behind), text, id=f"{name}-{'central' if behind else 'forward'}-{h:g}")
        for behind, text, steps in kinds
        for h in steps
    ]


def _repeated_entry(k):
    """The Hessian with its other diagonal entry copied from the k-th."""

    def variant(x):
        H = wells.hessian(x)
        H[1 - k, 1 - k] = H[k, k]
        return H

    return variant


def _arrives(x):
    """Whether a few of Newton's steps from a place end in the saddle, which is near it all the way."""
    saddle, x = wells.extrema()[2].x, np.array(x, dtype=float)
    for _ in range(FEW):
        if np.linalg.norm(x - saddle) > WITHIN_REACH:
            return False
        x = x + opt.newton_step(wells.gradient(x), wells.hessian(x))
    return bool(np.linalg.norm(x - saddle) < 1e-6)


def _slope_there(x):
    """Whether a place is stationary, and of which kind, as a sentence."""
    slope, bends = np.linalg.norm(wells.gradient(x)), np.linalg.eigvalsh(wells.hessian(x))
    if np.abs(bends).max() < FLAT:
        return "There f is nearly flat, far out on the plain, where the gradient fades and vanishes nowhere: start between the wells"
    if bends.min() > 0 and slope < NEXT_TO * bends.min():
        return "That is a minimum, or within a hundredth of one: f bends up there in all directions"
    further = ", and one is near: a few of Newton's steps from there end in it" if _arrives(x) else ""
    return f"There the gradient is {slope:.3g} long. At a saddle it vanishes{further}"


def _equal_depths():
    """The place on the line between the centers where both wells contribute alike to f."""
    near, far = wells.CENTERS
    share = brentq(lambda t: np.diff(wells.DEPTHS / _terms((1 - t) * near + t * far)[1])[0], 0, 1)
    return (1 - share) * near + share * far


FLAT, NEXT_TO = 1.0, 1e-2  # curvature that is next to nothing; how far off a minimum may be that is told as such
WITHIN_REACH, FEW = 0.3, 6  # of the saddle, where it is called near; Newton's steps that are a few
NOT_DOWNHILL = "A search downhill ends in a well, and so do Newton's steps from a start near it. They end in the saddle from a start near the pass between the wells."


CHAPTER = Chapter(
    "04-optimization",
    [
        Exercise(
            "gradient",
            reference=wells.gradient,
            draw=PLACES,
            fixed={"x": TWO},
            metric=metrics.Numbers(1e-6),  # central differences are right as well
            noisy=special_places(4e-7) + 3 * [BESIDE_THE_CENTER],
            hints=(
                "Each well is −w/q with q = |x − c|² + 1. Differentiate it by the chain rule, q first.",
                "The derivative of −w/q is (w/q²) times the gradient of q, and the gradient of q is 2(x − c).",
                "`d1, d2 = x - [1, 1], x - [-1, -2]\nq1, q2 = d1 @ d1 + 1, d2 @ d2 + 1\n"
                "return 200 / q1**2 * d1 + 400 / q2**2 * d2`",
            ),
            mistakes=[
                Mistake(
                    lambda x: wells.gradient(x) / 2,
                    "Half of the gradient. Is it the 2 in 2(x − c), the gradient of |x − c|², that is missing?",
                    id="gradient-edcc5c",
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
                *_one_well_alone(_gradient, "gradient"),
                *(
                    Mistake(
                        _gradient_with_one_q(k),
                        f"Both terms are divided by the q of the well at {center}. Each well has a q of its own, |x − c|² + 1.",
                        id=f"gradient-q-of-{k}",
                    )
                    for k, center in enumerate(("(1, 1)", "(−1, −2)"))
                ),
                Mistake(
                    _gradient(depths=(200.0, 100.0)),
                    "The depths are exchanged: w = 100 at (1, 1), w = 200 at (−1, −2).",
                ),
                Mistake(
                    _gradient(depths=(100.0, 100.0)),
                    "The part of the well at (−1, −2) is half of what it should be: w = 200 there, and every factor is the same as at (1, 1).",
                    id="gradient-bd7c66",
                ),
                Mistake(
                    _gradient(depths=(100.0, -200.0)),
                    "The second well is subtracted: both terms are −w/q, so their gradients add up.",
                ),
                Mistake(_gradient(one=0.0), "The 1 in q = |x − c|² + 1 is missing from your denominators."),
                Mistake(
                    lambda x: np.full(2, (_factors(x) / 2).sum()),
                    "The inner derivative is missing: w/q² still has to be multiplied by the gradient of q, 2(x − c).",
                    id="gradient-inner",
                ),
                Mistake(
                    lambda x: np.full(2, _factors(x).sum()),
                    "2w/q² is a number for each well; multiply it by x − c, which tells the direction.",
                    id="gradient-direction",
                ),
                Mistake(
                    lambda x: _factors(x).sum() * x,
                    "The gradient of q = |x − c|² + 1 is 2(x − c), not 2x: each well pulls toward its own center.",
                    id="gradient-center",
                ),
                Mistake(
                    lambda x: np.repeat(wells.gradient(x)[0], 2),
                    "Both entries are the derivative by x1. The second one is by x2: was a line copied?",
                    id="gradient-copied",
                ),
                Mistake(
                    lambda x: wells.gradient(x)[::-1],
                    "The two entries have changed places: the derivative by x1 comes first.",
                    id="gradient-order",
                ),
                Mistake(
                    lambda x: wells.value(x),
                    "This is f itself. The gradient has two entries, its derivatives by x1 and x2.",
                    id="gradient-value",
                ),
                Mistake(
                    _gradient(power=3),
                    "Your denominators are q³: that is the power of the second derivative. The derivative of −1/q is 1/q² times that of q.",
                    id="gradient-cubed",
                ),
                Mistake(
                    lambda x: wells.gradient(x) / np.linalg.norm(wells.gradient(x)),
                    "This is the direction of the gradient, of length 1. Its length tells how steep f is: leave it.",
                    id="gradient-unit",
                ),
                Mistake(
                    _gradient(second=(-2.0, -1.0)),
                    "The second center is (−1, −2), x1 first: its offsets are x1 + 1 and x2 + 2.",
                    id="gradient-center-order",
                ),
                Mistake(
                    _gradient(second=(1.0, 1.0)),
                    "Both wells sit at (1, 1) here. The deeper one has its center at (−1, −2).",
                    id="gradient-one-center",
                ),
                Mistake(
                    lambda x: wells.gradient(x) / 100,
                    "A hundredth of the gradient, as of wells of depths 1 and 2: they are 100 and 200.",
                    id="gradient-depths",
                ),
                Mistake(
                    lambda x: (
                        2 * wells.DEPTHS[:, None] * (x - wells.CENTERS) / ((x - wells.CENTERS) ** 2 + 1) ** 2
                    ).sum(0),
                    "Each entry has a q of its own here, made of one offset. q = |x − c|² + 1 is one number a well, in which both offsets count.",
                    id="gradient-own-q",
                ),
                *_wide_differences("gradient", wells.value, (0.1, 0.01, 1e-3, 1e-4, 1e-5, 1e-6), (0.1, 0.01, 1e-3)),
            ],
        ),
        Exercise(
            "measured_gradient",
            reference=beyond.measured_gradient,
            draw=beyond.function_and_step,
            metric=metrics.Numbers(1e-9),
            noisy=[(draw, metrics.Numbers(tol, least=least), words) for draw, tol, least, words in beyond.MEASURED],
            properties=(),
            hints=(
                "Move one unknown at a time, a step to each side, and leave the others where they are.",
                "Component k is (f(x + h e) − f(x − h e)) / (2h), where e is the unit vector of unknown k: a row of `np.eye(len(x))`.",
                "`return np.array([(f(x + e) - f(x - e)) / (2 * h) for e in h * np.eye(len(x))])`",
            ),
            mistakes=[
                Mistake(
                    beyond.differences(lambda f, x, e, h: (f(x + e) - f(x)) / h),
                    "These are forward differences, off by about ½h times the curvature. Step to both sides: f(x + h e) − f(x − h e).",
                    id="measured-forward",
                ),
                Mistake(
                    beyond.differences(lambda f, x, e, h: (f(x) - f(x - e)) / h),
                    "These are backward differences, off by about ½h times the curvature. Step to both sides: f(x + h e) − f(x − h e).",
                    id="measured-backward",
                ),
                Mistake(
                    beyond.differences(lambda f, x, e, h: (f(x + e) - f(x - e)) / h),
                    "Twice too large: the two places are 2h apart.",
                    id="measured-twice",
                ),
                Mistake(
                    beyond.differences(lambda f, x, e, h: (f(x + e) - f(x - e)) / 2 * h),
                    "The h multiplies here, as in `/ 2 * h`. Divide by both: `/ (2 * h)`.",
                    id="measured-times-h",
                ),
                *(
                    Mistake(
                        beyond.differences(difference),
                        "One of your two places is x itself, h from the other one, and you divide by 2h. Step to both sides: f(x + h e) − f(x − h e).",
                        id=f"measured-half-{side}",
                    )
                    for side, difference in (
                        ("ahead", lambda f, x, e, h: (f(x + e) - f(x)) / (2 * h)),
                        ("behind", lambda f, x, e, h: (f(x) - f(x - e)) / (2 * h)),
                    )
                ),
                Mistake(
                    beyond.differences(lambda f, x, e, h: f(x + e) - f(x - e) / (2 * h)),
                    "Division comes before subtraction: put the difference `f(x + h e) - f(x - h e)` in parentheses.",
                    id="measured-parentheses",
                ),
                Mistake(
                    beyond.differences(lambda f, x, e, h: f(x + e) - f(x - e)),
                    "These are differences, not slopes: divide by the distance of the two places, 2h.",
                    id="measured-undivided",
                ),
                Mistake(
                    beyond.differences(lambda f, x, e, h: (f(x + e / 2) - f(x - e / 2)) / h),
                    "You go half a step to each side. That is a central difference too, with the step ½h: take h.",
                    id="measured-half-step",
                ),
                Mistake(
                    beyond.differences(lambda f, x, e, h: (f(x - e) - f(x + e)) / (2 * h)),
                    "The sign is reversed: ahead minus behind.",
                    id="measured-sign",
                ),
                Mistake(
                    beyond.differences(lambda f, x, e, h: (f(x + e) - 2 * f(x) + f(x - e)) / h**2),
                    "That is the second difference, the curvature along each axis. The slope is (ahead − behind) / (2h).",
                    id="measured-second",
                ),
                Mistake(
                    lambda f, x, h: np.full(len(x), (f(x + h) - f(x - h)) / (2 * h)),
                    "`x + h` moves all unknowns at once. Move one at a time: h times a row of `np.eye(len(x))`.",
                    id="measured-all",
                ),
                Mistake(
                    lambda f, x, h: np.zeros(len(x)),
                    "All slopes come out 0. If you step to complex places, x + 1j h e: f takes real numbers, and drops the rest. Step to both sides, "
                    "f(x + h e) − f(x − h e).",
                    id="measured-nought",
                ),
                *(
                    Mistake(
                        variant,
                        "Only the first component is right: put each unknown back before you move the next one.",
                        id=id,
                    )
                    for variant, id in (
                        (beyond.not_put_back, "measured-not-restored"),
                        (beyond.neither_put_back, "measured-neither-restored"),
                    )
                ),
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
            draw=PLACES,
            fixed={"x": TWO},
            metric=metrics.Numbers(1e-6),
            noisy=special_places(1e-6),
            hints=(
                "Differentiate the gradient (2w/q²)(x − c) once more: the product rule gives two terms for each well.",
                "One term is (2w/q²) I. The other one is (x − c) times the gradient of 2w/q², an outer product: −(8w/q³) (x − c)(x − c)ᵀ. "
                "A loop over the two wells adds up both terms, with `np.eye(2)` and `np.outer(d, d)`.",
                "`H = np.zeros((2, 2))\nfor w, c in ((100, [1, 1]), (200, [-1, -2])):\n    d = x - np.array(c)\n    q = d @ d + 1\n"
                "    H += 2 * w / q**2 * np.eye(2) - 8 * w / q**3 * np.outer(d, d)\nreturn H`",
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
                *_one_well_alone(_hessian, "hessian"),
                Mistake(
                    _diagonal_only,
                    "The mixed derivatives are not zero: q holds both offsets, so that each entry of the gradient depends on x1 and on x2.",
                    id="hessian-4cc8d8",
                ),
                Mistake(
                    _hessian(factor=4.0), "The outer product is too small by a factor 2: the gradient of q is 2(x − c)."
                ),
                Mistake(_hessian(power=2), "The derivative of 1/q² has q³ in its denominator."),
                Mistake(
                    _hessian_with(product=np.dot),
                    "The number |x − c|², `d @ d`, lowers all four entries alike here. The matrix is `np.outer(d, d)`.",
                    id="hessian-beb5fa",
                ),
                Mistake(
                    _hessian_with(product=lambda a, b: np.dot(a, b) * np.eye(2)),
                    "`d @ d.T` of a vector is the number |d|²: the part that bends down is `np.outer(d, d)`, a matrix.",
                    id="hessian-number",
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
                    "This is the well at (−1, −2) alone: add the one at (1, 1). In a loop over both that is `H += ...`, not `H = ...`.",
                    id="hessian-2e0183",
                ),
                Mistake(
                    _hessian_with(wells_seen=(0,)),
                    "This is the well at (1, 1) alone: add the one at (−1, −2). A `return` inside a loop ends it too early.",
                    id="hessian-7f0d15",
                ),
                Mistake(
                    _hessian(factor=2.0),
                    "The outer product is too small by a factor 4: the derivative of 2w/q² is −4w/q³ times that of q, 2(x − c).",
                ),
                Mistake(
                    _hessian(depths=(200.0, 100.0)), "The depths are exchanged: w = 100 at (1, 1), w = 200 at (−1, −2)."
                ),
                Mistake(
                    _hessian(depths=(100.0, 100.0)),
                    "The part of the well at (−1, −2) is half of what it should be: w = 200 there, and every factor is the same as at (1, 1).",
                    id="hessian-one-depth",
                ),
                *(
                    Mistake(
                        _hessian(factor=np.where(np.arange(2) == k, factor, 8.0)),
                        f"The outer product of the well at {center} {word}: −(8w/q³)(x − c)(x − c)ᵀ with w = {depth} there.",
                        id=f"hessian-outer-{k}-{name}",
                    )
                    for k, (center, depth) in enumerate((("(1, 1)", 100), ("(−1, −2)", 200)))
                    for factor, name, word in (
                        (4.0, "half", "is half of what it should be"),
                        (16.0, "twice", "is twice what it should be"),
                        (0.0, "missing", "is missing"),
                        (-8.0, "sign", "has the wrong sign"),
                    )
                ),
                Mistake(
                    _hessian(power=4),
                    "Your outer product is divided by q⁴: the derivative of 1/q² has q³ below, times that of q.",
                    id="hessian-q4",
                ),
                *(
                    Mistake(
                        _repeated_entry(k),
                        f"Both entries on the diagonal are those of x{k + 1}. The one of x{2 - k} holds the square of its own offset.",
                        id=f"hessian-repeated-{k}",
                    )
                    for k in range(2)
                ),
                *(
                    Mistake(
                        _twice_ahead(h),
                        "These are second differences of f, all steps ahead: they are off by about h times the third derivative. Differentiate by hand, or "
                        "take central differences of your gradient, with h = 1e-5.",
                        id=f"hessian-twice-ahead-{h:g}",
                    )
                    for h in (0.1, 0.01, 1e-3, 1e-4)
                ),
                *_wide_differences("hessian", wells.gradient, (0.1, 0.01, 1e-3, 1e-4, 1e-5, 1e-6), (0.1, 0.01, 1e-3)),
                Mistake(
                    lambda x: wells.hessian(x) / 2,
                    "Half of the Hessian. Is a 2 missing in both terms? Or is it the Hessian of ½|r|², which is f/2 but for a constant?",
                    id="hessian-half",
                ),
                Mistake(
                    lambda x: wells.jacobian(x).T @ wells.jacobian(x),
                    "This is JᵀJ, the matrix of Gauss-Newton. The Hessian of f is twice that, and what the second derivatives of the residuals add.",
                    id="hessian-gauss-newton",
                ),
                Mistake(
                    lambda x: 2 * wells.jacobian(x).T @ wells.jacobian(x),
                    "This is 2JᵀJ, what Gauss-Newton takes for it. The Hessian also holds what the second derivatives of the residuals add.",
                    id="hessian-gauss-newton-2",
                ),
                Mistake(
                    _hessian(second=(1.0, 2.0)), "The second well sits at (−1, −2): its offsets are x1 + 1 and x2 + 2."
                ),
                Mistake(_hessian(one=0.0), "The 1 in q = |x − c|² + 1 is missing."),
                Mistake(
                    _hessian(second=(1.0, 1.0)),
                    "Both wells sit at (1, 1) here. The deeper one has its center at (−1, −2).",
                    id="hessian-one-center",
                ),
                Mistake(
                    _hessian(bowl=0.0),
                    "Only the outer products are there. The part (2w/q²) I comes from differentiating x − c.",
                ),
            ],
        ),
        Exercise(
            "classify_extremum",
            reference=classify_extremum,
            sizes=("g", "H"),
            draw=KINDS,
            metric=metrics.Exactly(),
            noisy=[
                (gradient_at_the_limit, metrics.Exactly(), "right, but not where |g| is 1e-6, no more and no less:"),
                *((draw, metrics.Exactly(), words) for draw, words in STATIONARY),
            ],
            draws=len(KINDS),
            fixed={"g": TWO, "H": TWO},
            hints=(
                "First order first: only a place where the gradient vanishes is a candidate at all.",
                "First order: is |g| above 1e-6? Then second order: the signs of the eigenvalues of H, `np.linalg.eigvalsh(H)`, tell how f bends along its two main directions.",
                '`if np.linalg.norm(g) > 1e-6:\n    return "not stationary"\ne = np.linalg.eigvalsh(H)\n'
                'return "minimum" if (e > 0).all() else "maximum" if (e < 0).all() else "saddle"`',
            ),
            mistakes=[
                Mistake(
                    _second_order_only,
                    "You judge places where the gradient is not zero: they are no extrema, whatever H says.",
                ),
                Mistake(
                    _kind_before_slope(("saddle",)),
                    'Wherever H bends both ways you say "saddle", whatever g is. Where the gradient does not vanish, the point is no saddle either: '
                    '"not stationary" comes first.',
                    id="classify-order-saddle",
                ),
                *(
                    Mistake(
                        _kind_before_slope(early),
                        "At some places H alone decides here, whatever g is. Where the gradient does not vanish, the signs of the eigenvalues decide "
                        'nothing: "not stationary" comes first.',
                        id=f"classify-order-{k}",
                    )
                    for k, early in enumerate(
                        (("maximum",), ("minimum",), ("minimum", "maximum"), ("maximum", "saddle"))
                    )
                ),
                Mistake(
                    _stationary(_by(np.linalg.eigvalsh), lambda g: g @ g > 1e-6),
                    "In effect your limit for |g| is about 1e-3, not 1e-6. If you compare `g @ g` with 1e-6: that is the square of the length, take its root first.",
                    id="classify-square",
                ),
                Mistake(
                    _stationary(_by(np.linalg.eigvalsh), lambda g: (np.abs(g) > 1e-6).any()),
                    "A g with both entries just below 1e-6 counts as vanished here, and is longer than that: |g| is the root of the sum of their squares, "
                    "neither the larger of them nor a mean.",
                    id="classify-entries",
                ),
                Mistake(
                    _stationary(_by(np.linalg.eigvalsh), lambda g: abs(g.sum()) > 1e-6),
                    "You add the entries of g, and where they have opposite signs they cancel: |g| is the root of the sum of their squares.",
                    id="classify-sum",
                ),
                Mistake(
                    _stationary(_by(np.linalg.eigvalsh), lambda g: (np.abs(g) > 1e-6).all()),
                    "In effect both entries of g must be large. A gradient along one axis has an entry that is 0, and is not small: take the length |g|.",
                    id="classify-all",
                ),
                *(
                    Mistake(
                        _stationary(_by(np.linalg.eigvalsh), lambda g, k=k: abs(g[k]) > 1e-6),
                        f"Only the {which} entry of g decides here. What counts is the length |g|, the root of the sum of both squares.",
                        id=f"classify-{which}-entry",
                    )
                    for k, which in enumerate(("first", "second"))
                ),
                *(
                    Mistake(
                        _stationary(_by(np.linalg.eigvalsh), lambda g, limit=limit: np.linalg.norm(g) > limit),
                        "Right where |g| is large, and where it is tiny. But your limit is not the stated one, 1e-6.",
                        id=f"classify-limit-{k}",
                    )
                    for k, limit in enumerate((1e-5, 1e-4, 1e-2))
                ),
                *(
                    Mistake(
                        _stationary(_by(np.linalg.eigvalsh), lambda g, limit=limit: np.linalg.norm(g) > limit),
                        "Right where |g| is above 1e-6, and where it is next to nothing. But your limit is smaller than the stated one, 1e-6.",
                        id=f"classify-smaller-limit{also}",
                    )
                    for limit, also in ((1e-8, ""), (5e-7, "-2"))
                ),
                Mistake(_first_order_only, "A vanishing gradient is necessary, not sufficient: a saddle has one too."),
                Mistake(
                    _stationary(_by(np.diag)),
                    "At a saddle both entries on the diagonal of H may have the same sign: use the eigenvalues.",
                    id="classify_extremum-e3629d",
                ),
                Mistake(
                    _stationary(_by(np.trace)),
                    "The trace is the sum of the eigenvalues: a saddle with one large positive one has a positive trace too.",
                ),
                Mistake(
                    _stationary(_by(np.linalg.eigvalsh), lambda g: g.any()),
                    "After an iteration the gradient is hardly ever exactly 0: up to a norm of 1e-6 it counts as vanished.",
                    id="classify_extremum-02713b",
                ),
                Mistake(
                    _stationary(_by(np.linalg.eigvalsh), lambda g: np.abs(g).sum() > 1e-6),
                    "You add the absolute values of both entries. |g| is the root of the sum of their squares, and smaller.",
                    id="kind-sum-of-entries",
                ),
                Mistake(
                    _stationary(_by(np.linalg.eigvalsh), lambda g: (g > 1e-6).any()),
                    "A large negative component is not small: use the norm of g.",
                ),
                Mistake(
                    _stationary(_by(lambda H: (lambda e: np.where(abs(e) < 1e-6, 0.0, e))(np.linalg.eigvalsh(H)))),
                    "In effect small eigenvalues count as 0 here. None is 0, however faintly f bends: the sign of each tells.",
                    id="kind-eigenvalues-cut-off",
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
                    lambda g, H: classify_extremum(g, H).replace("saddle", "saddle point"),
                    'The kinds are right; the word is "saddle", without "point".',
                ),
                Mistake(
                    _swapped,
                    "Minimum and maximum are exchanged: at a minimum f bends up, all eigenvalues are positive.",
                ),
                Mistake(
                    _stationary(lambda H: "minimum" if (np.linalg.eigvalsh(H) > 0).all() else "saddle"),
                    "A maximum is called a saddle: where all eigenvalues are negative, f bends down in every direction.",
                    id="classify-no-maximum",
                ),
            ],
        ),
        Exercise(
            "newton_step",
            reference=opt.newton_step,
            sizes=("g", "H"),
            draw=MODELS,
            fixed={"g": TWO, "H": TWO},
            metric=metrics.Numbers(1e-9),
            noisy=[
                (diagonal_model, metrics.Numbers(1e-9), "right, but not where H is diagonal:"),
                (faint_model, metrics.Numbers(1e-9), "right, but not where f is nearly flat, H tiny and g with it:"),
                (
                    long_step,
                    metrics.Numbers(1e-9),
                    "right, but not where f is so flat that the step is millions long:",
                ),
                (there_already, metrics.Numbers(1e-9), "right, but not where g is 0 already:"),
                *(
                    (
                        functools.partial(no_curvature_along, k=k),
                        metrics.Numbers(1e-9),
                        f"right, but not where H[{k}, {k}] is 0:",
                    )
                    for k in (0, 1)
                ),
                (
                    valley,
                    metrics.Numbers(1e-7),
                    "right, but not where f bends a million times more one way than the other:",
                ),
            ],
            hints=(
                "The quadratic model is stationary where its gradient g + H h vanishes.",
                "Solve H h = −g for h. No inverse is needed, and no H⁻¹ as in equation (2-26) either.",
                "`return -np.linalg.solve(H, g)`",
            ),
            mistakes=[
                Mistake(
                    lambda g, H: np.linalg.det(H) * opt.newton_step(g, H),
                    "Your step is det H times Newton's: the inverse of a 2 x 2 matrix is divided by its determinant.",
                    id="newton-undivided",
                ),
                Mistake(
                    lambda g, H: np.linalg.solve(H, g),
                    "This is the step with the wrong sign, the d of equations (2-24) and (2-25): there x − d is the next point.",
                ),
                Mistake(
                    lambda g, H: -(g / H).sum(axis=0),
                    "You divide by the entries of H, one by one, and add up. The inverse of a matrix is another thing: "
                    "`np.linalg.solve(H, -g)`.",
                    id="newton-entry-by-entry",
                ),
                Mistake(
                    lambda g, H: -H @ g, "You multiplied by H, as equation (2-26) has it; the step solves H h = −g."
                ),
                Mistake(
                    lambda g, H: -g / np.diag(H),
                    "Dividing by the diagonal ignores the mixed derivatives: solve the system.",
                ),
                Mistake(
                    lambda g, H: -g / H,
                    "`g / H` divides entry by entry, a row of H at a time, and leaves a 2x2 array. H h = −g is a system: `np.linalg.solve`.",
                    id="newton-divided",
                ),
                Mistake(
                    lambda g, H: g / H,
                    "`g / H` divides entry by entry, a row of H at a time, and leaves a 2x2 array. H h = −g is a system: `np.linalg.solve`.",
                    id="newton-divided-plus",
                ),
                Mistake(
                    lambda g, H: H @ g,
                    "You multiplied by H, and the sign is missing: the step solves H h = −g.",
                    id="newton-times",
                ),
                Mistake(lambda g, H: -g, "That is steepest descent: H is not used at all."),
                Mistake(
                    lambda g, H: -(g @ g) / (g @ H @ g) * g,
                    "This is the stationary point of the model along g alone. Newton's step solves H h = −g: in all directions at once.",
                    id="newton-along-g",
                ),
                Mistake(
                    lambda g, H: -(1 / H) @ g,
                    "Each entry of H is inverted by itself, as by `1 / H`. The inverse matrix is `np.linalg.inv(H)`; better solve the system.",
                ),
                Mistake(
                    lambda g, H: -g / np.linalg.det(H),
                    "Dividing by the determinant is not solving: H h = −g is a system of two equations.",
                ),
                Mistake(
                    lambda g, H: -np.linalg.solve(_all_positive(H), g),
                    "Downhill along every direction, by |curvature|. Newton keeps the signs of H: where f bends down it climbs.",
                ),
                Mistake(
                    lambda g, H: -np.linalg.solve(H, g) / np.linalg.norm(np.linalg.solve(H, g)),
                    "The direction is right, and its length 1. Newton's step has a length of its own: it ends where the model is stationary.",
                    id="newton-unit",
                ),
                Mistake(
                    lambda g, H: np.linalg.solve(H, g).reshape(2, 1),
                    "This is a column, shape (2, 1), and its sign is reversed. The step has the shape of g, (2,).",
                    id="newton-column-plus",
                ),
                Mistake(
                    lambda g, H: -np.linalg.solve(H, g).reshape(2, 1),
                    "The numbers are right, in a column of shape (2, 1). The step has the shape of g, (2,).",
                    id="newton-column",
                ),
            ],
        ),
        Value(
            "saddle",
            reference=lambda: wells.extrema()[2].x,
            metric=metrics.Numbers(3e-4),  # one step from the printed point is not there yet
            about=_slope_there,
            hints=(
                "Close to a place where the gradient vanishes Newton goes there, whatever its kind.",
                "Start at (0, 0) and repeat x = x + newton_step(gradient(x), hessian(x)) until x stands still. If it runs away, start between the wells.",
                "`saddle = np.zeros(2)\nfor _ in range(10):\n    saddle = saddle + newton_step(gradient(saddle), hessian(saddle))`",
            ),
            mistakes=[
                Mistake(
                    lambda: np.array([0.105, -0.205]),
                    "That is what the thesis prints. Evaluate your gradient there: it is about 2.5 long.",
                ),
                Mistake(
                    lambda: wells.CENTERS.mean(0),
                    "That is halfway between the centers. The pass lies nearer to the shallower well: the deeper one reaches farther.",
                ),
                Mistake(
                    lambda: wells.extrema()[0].x,
                    f"That is the local minimum. {NOT_DOWNHILL}",
                    id="saddle-4988a7",
                ),
                Mistake(
                    lambda: wells.extrema()[1].x,
                    f"That is the global minimum. {NOT_DOWNHILL}",
                    id="saddle-949f0c",
                ),
                Mistake(
                    lambda: (wells.extrema()[0].x + wells.extrema()[1].x) / 2,
                    "That is halfway between both minima. The pass lies nearer to the shallower well: the deeper one reaches farther.",
                    id="saddle-between-minima",
                ),
                Mistake(
                    lambda: np.array([-0.9948, -1.9922]),
                    f"That is the global minimum, as the thesis prints it. {NOT_DOWNHILL}",
                    id="saddle-printed-global",
                ),
                Mistake(
                    lambda: np.array([0.9789, 0.9684]),
                    f"That is the local minimum, as the thesis prints it. {NOT_DOWNHILL}",
                    id="saddle-printed-local",
                ),
                Mistake(
                    lambda: wells.CENTERS.sum(0) - wells.extrema()[2].x,
                    "This is as far from (−1, −2) as the saddle is from (1, 1): on the line t runs from (1, 1) to (−1, −2).",
                    id="saddle-from-the-other-end",
                ),
                Mistake(
                    _equal_depths,
                    "There both wells contribute alike to f. At the saddle it is their slopes that cancel: the gradient vanishes.",
                    id="saddle-equal-depths",
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
        Prediction(
            "convex_share",
            question="In what share of the square from −6 to 6 is the Hessian of f positive definite?",
            choices=("about 1 %", "about 20 %", "about half"),
            answer="about 1 %",
            why="Only in two small patches around L and G, half a unit in radius. f has two minima and is convex nearly nowhere.",
        ),
        Exercise(
            "rise_above_chord",
            reference=convexity.rise_above_chord,
            draw=(
                functools.partial(beyond.hilly, falls=True),
                beyond.bowl,
                functools.partial(beyond.hilly, falls=False),
            ),
            metric=metrics.Numbers(1e-9),
            noisy=[(draw, metrics.Numbers(tol, least=least), words) for draw, tol, least, words in beyond.CHORDS],
            hints=(
                "Walk from x to y, and at each place compare f with the straight line between its two ends.",
                "At the fraction t the place is (1 − t) x + t y, and the chord stands at (1 − t) f(x) + t f(y). Of the differences f − chord take the largest.",
                "`t = np.linspace(0, 1, n)\nvalues = np.array([f((1 - s) * x + s * y) for s in t])\n"
                "return (values - ((1 - t) * f(x) + t * f(y))).max()`",
            ),
            mistakes=[
                Mistake(
                    beyond.chords(lambda t, v, c: (v - c[::-1]).max()),
                    "Your chord has at one end the height of the other: are its ends exchanged, or does np.interp get numbers that fall? At the fraction t the place is (1 − t) x + t y, and its height (1 − t) f(x) + t f(y).",
                    id="chord-ends",
                ),
                Mistake(
                    beyond.chords(lambda t, v, c: (c - v).max()),
                    "That is how far f sags below its chord, as a convex f does. Asked for is how far it rises above, f − chord.",
                    id="chord-below",
                ),
                Mistake(
                    beyond.chords(lambda t, v, c: abs(v - c).max()),
                    "Without its sign the difference also counts where f lies below its chord, and there it may: no absolute value.",
                    id="chord-absolute",
                ),
                Mistake(
                    lambda f, x, y, n: max(0.0, f((x + y) / 2) - (f(x) + f(y)) / 2),
                    "You looked at the middle alone. f can rise above its chord elsewhere: compare all n places.",
                    id="chord-middle",
                ),
                Mistake(
                    lambda f, x, y, n: f((x + y) / 2) - (f(x) + f(y)) / 2,
                    "You looked at the middle alone. f can rise above its chord elsewhere: compare all n places.",
                    id="chord-middle-signed",
                ),
                Mistake(
                    beyond.chords(lambda t, v, c: (v - c).mean()),
                    "That is the mean difference, in which rising and sagging cancel: take the largest.",
                    id="chord-mean",
                ),
                Mistake(
                    beyond.chords(lambda t, v, c: (v - max(v[0], v[-1])).max()),
                    "You compare with the higher end. The chord is the straight line between both ends.",
                    id="chord-higher-end",
                ),
                Mistake(
                    beyond.chords(lambda t, v, c: (v - v[0]).max()),
                    "You compare with f(x) alone. The chord goes on to f(y): (1 − t) f(x) + t f(y).",
                    id="chord-first-end",
                ),
                Mistake(
                    beyond.chords(lambda t, v, c: (v - (v[0] + v[-1]) / 2).max()),
                    "You compare with the mean of both ends, which is the chord's height in its middle alone: (1 − t) f(x) + t f(y).",
                    id="chord-mean-of-ends",
                ),
                Mistake(
                    beyond.chords(lambda t, v, c: v.max()),
                    "That is the highest value of f on the way: subtract the chord at each place first.",
                    id="chord-highest",
                ),
                Mistake(
                    beyond.chords(lambda t, v, c: (v - c)[1:-1].max()),
                    "Both ends count among the n places: f and chord meet there, so that the rise is never below 0.",
                    id="chord-inside",
                ),
                Mistake(
                    beyond.chords(lambda t, v, c: (v - c).min()),
                    "That is the lowest of the differences f − chord, how far f sags. The largest is asked for.",
                    id="chord-lowest",
                ),
                Mistake(
                    beyond.other_places(lambda n: np.linspace(0, 1, n, endpoint=False)),
                    "Your places differ from those asked for: n of them from 0 to 1, both ends included, `np.linspace(0, 1, n)`.",
                    id="chord-endpoint",
                ),
                Mistake(
                    beyond.other_places(lambda n: np.linspace(0, 1, n + 1)),
                    "Your places differ from those asked for: n of them from 0 to 1, both ends included, `np.linspace(0, 1, n)`.",
                    id="chord-one-more",
                ),
                Mistake(
                    beyond.chords(lambda t, v, c: t[np.argmax(v - c)]),
                    "That is the fraction t at which f rises most: return the rise there.",
                    id="chord-share",
                ),
                Mistake(
                    beyond.chords(lambda t, v, c: (v - c).sum()),
                    "This is the sum over all places. Asked for is the largest rise among them.",
                    id="chord-sum",
                ),
                Mistake(
                    beyond.other_places(lambda n: np.linspace(0, 1, 21)),
                    "You look at 21 places whatever n is: `np.linspace(0, 1, n)`.",
                    id="chord-twenty-one",
                ),
                Mistake(
                    beyond.other_places(lambda n: np.linspace(0, 1, n + 2)[1:-1]),
                    "This comes out where the ends, which count nothing, are left out, or come on top of n places between them: n of them, "
                    "both ends included, is `np.linspace(0, 1, n)`.",
                    id="chord-no-ends",
                ),
                Mistake(
                    beyond.other_places(lambda n: np.linspace(0, 1, n - 1)),
                    "You look at n − 1 places: `np.linspace(0, 1, n)` has n of them, both ends included.",
                    id="chord-one-less",
                ),
            ],
        ),
        Exercise(
            "jacobian",
            reference=wells.jacobian,
            sizes=("x",),
            draw=PLACES,
            fixed={"x": TWO},
            metric=metrics.Numbers(1e-6),
            noisy=special_places(1e-6),
            hints=(
                "Each residual vector is √(w/q) times x − c, a product: two terms for each well, a 2x2 block.",
                "√(w/q) times the derivative of x − c, which is I, plus (x − c) times the gradient of √(w/q), an outer product: "
                "√(w/q) (I − (x − c)(x − c)ᵀ/q). The block of the well at (1, 1) comes first, the other beneath it.",
                "`blocks = []\nfor w, c in ((100, [1, 1]), (200, [-1, -2])):\n    d = x - np.array(c)\n    q = d @ d + 1\n"
                "    blocks.append(np.sqrt(w / q) * (np.eye(2) - np.outer(d, d) / q))\nreturn np.vstack(blocks)`",
            ),
            mistakes=[
                Mistake(
                    _jacobian(lambda d, q: 0 * np.outer(d, d)),
                    "You differentiated only x − c. The factor √(w/q) depends on x as well: product rule.",
                    id="jacobian-product-rule",
                ),
                Mistake(
                    _jacobian(lambda d, q: -np.outer(d, d) / q),
                    "The outer product has the wrong sign: √(w/q) shrinks as q grows.",
                    id="jacobian-sign",
                ),
                Mistake(
                    _jacobian(lambda d, q: 2 * np.outer(d, d) / q),
                    "The outer product is twice as large as it should be: the root has the derivative −½ w/q² divided by √(w/q), times 2(x − c).",
                    id="jacobian-twice",
                ),
                Mistake(
                    _jacobian(lambda d, q: np.outer(d, d) / 2 / q),
                    "The outer product is half of what it should be: the gradient of q is 2(x − c).",
                    id="jacobian-half",
                ),
                Mistake(
                    _jacobian(lambda d, q: np.outer(d, d)),
                    "The outer product is to be divided by q: √(w/q) (I − (x − c)(x − c)ᵀ/q).",
                    id="jacobian-no-q",
                ),
                Mistake(
                    _jacobian(lambda d, q: d @ d / q * np.eye(2)),
                    "`d @ d` is a number. The matrix is `np.outer(d, d)`.",
                    id="jacobian-number",
                ),
                Mistake(
                    _jacobian(lambda d, q: np.outer(d, d) / q, depths=(10000.0, 40000.0)),
                    "The root of w is missing: the residuals hold √(w/q), so that their squares hold w/q.",
                    id="jacobian-root",
                ),
                Mistake(
                    _jacobian(lambda d, q: np.outer(d, d) / q, depths=(200.0, 100.0)),
                    "The depths are exchanged: w = 100 at (1, 1), w = 200 at (−1, −2).",
                    id="jacobian-depths",
                ),
                Mistake(
                    lambda x: wells.jacobian(x)[[2, 3, 0, 1]],
                    "The blocks have changed places: the rows of the well at (1, 1) come first.",
                    id="jacobian-order",
                ),
                Mistake(
                    lambda x: wells.jacobian(x)[[0, 2, 1, 3]],
                    "The rows of the two wells take turns. Both rows of the well at (1, 1) come first, then both of the other one.",
                    id="jacobian-in-turns",
                ),
                Mistake(
                    lambda x: wells.jacobian(x).T,
                    "This is the transpose: one row a residual, one column an unknown, shape (4, 2).",
                    id="jacobian-transpose",
                ),
                Mistake(
                    lambda x: wells.jacobian(x).reshape(2, 2, 2).sum(0),
                    "You added the blocks of the two wells. The four residuals stay apart: one block beneath the other, `np.vstack`.",
                    id="jacobian-added",
                ),
                Mistake(
                    lambda x: 2 * wells.jacobian(x).T @ wells.residual(x),
                    "This is the gradient of f, 2Jᵀr. J itself has four rows, one a residual.",
                    id="jacobian-gradient",
                ),
                Mistake(
                    lambda x: _jacobian_with(x, lambda w, q: w / q),
                    "The root is missing: the factor in front is √(w/q).",
                    id="jacobian-no-root",
                ),
                Mistake(
                    lambda x: _jacobian_with(x, lambda w, q: np.sqrt(w) / q),
                    "Only w is under the root. The factor in front is √(w/q): put the quotient in parentheses.",
                    id="jacobian-root-of-w",
                ),
                Mistake(
                    lambda x: _jacobian_with(x, lambda w, q: np.sqrt(w)),
                    "Only w is under the root: the factor in front is √(w/q).",
                    id="jacobian-without-q",
                ),
                Mistake(
                    lambda x: _jacobian_with(x, product=lambda d: d @ d),
                    "The number |x − c|², `d @ d`, is taken from all four entries. The product of a column and a row is `np.outer(d, d)`.",
                    id="jacobian-inner",
                ),
                Mistake(
                    lambda x: _jacobian_with(x, depths=(100.0, 100.0)),
                    "The first two rows are right. The well at (−1, −2) is twice as deep: w = 200 there.",
                    id="jacobian-one-depth",
                ),
                Mistake(
                    lambda x: _jacobian_with(x, product=lambda d: np.outer(x, x)),
                    "The outer product takes x itself. It is that of x − c, the offset from the well's center.",
                    id="jacobian-of-x",
                ),
                *(
                    Mistake(
                        functools.partial(_jacobian_with, **without),
                        "The 1 of q = |x − c|² + 1 is missing, under the root at least.",
                        id=f"jacobian-without-1-{k}",
                    )
                    for k, without in enumerate(
                        (
                            {"factor": lambda w, q: np.sqrt(w / (q - 1))},
                            {
                                "factor": lambda w, q: np.sqrt(w / (q - 1)),
                                "product": lambda d: np.outer(d, d) * (d @ d + 1) / (d @ d),
                            },
                        )
                    )
                ),
                *_wide_differences("jacobian", wells.residual, (0.1, 0.01, 1e-3, 1e-4, 1e-5), (0.1, 0.01)),
            ],
        ),
        Exercise(
            "damped_step",
            reference=opt.damped_step,
            sizes=("r", "J", "damping"),
            draw=DAMPED,
            metric=metrics.Numbers(1e-7),
            noisy=[
                (functools.partial(damped_case, m=m, n=n, damping=damping), metrics.Numbers(1e-7, least=least), words)
                for m, n, damping, least, words in (
                    (3, 3, 2.0, 1.0, "right, but not for as many residuals as unknowns:"),
                    (3, 3, 0.0, 1.0, "right, but not for as many residuals as unknowns, without damping:"),
                    (1, 1, 2.0, 1.0, "right, but not for one residual and one unknown:"),
                    (60, 8, 2.0, 1.0, "right, but not for sixty residuals and eight unknowns:"),
                    (6, 3, 3e-4, 1.0, "right, but not for little damping:"),
                    (6, 3, 1e4, 1.0, "right, but not for much damping:"),
                    (6, 3, 1e7, 0.0, "right, but not for so much damping that the step is tiny:"),
                )
            ]
            + [
                (faint_jacobian, metrics.Numbers(1e-7), "right, but not where J and the damping are both small:"),
                (
                    columns_alike,
                    metrics.Numbers(1e-7),
                    "right, but not where one column of J is made of the others. With damping one step is best there too:",
                ),
                (
                    narrow_valley,
                    metrics.Numbers(1e-5),
                    "right, but not without damping where one combination of the unknowns hardly moves the residuals:",
                ),
            ],
            hints=(
                "Set the gradient of |r + J h|² + λ |h|² to zero: what is added to JᵀJ?",
                "(JᵀJ + λ I) h = −Jᵀr. Or without squaring J: least squares with √λ I beneath J, and zeros beneath r.",
                "`return -np.linalg.solve(J.T @ J + damping * np.eye(J.shape[1]), J.T @ r)`",
            ),
            mistakes=[
                Mistake(
                    lambda r, J, damping: -opt.damped_step(r, J, damping),
                    "The sign is wrong: r + J h should become small, so h has to counter r.",
                    id="damped-sign",
                ),
                Mistake(
                    lambda r, J, damping: opt.gauss_newton_step(r, J),
                    "This is the step of Gauss and Newton. The damping, which charges for length, has no part in it.",
                    id="damped-not",
                ),
                Mistake(
                    lambda r, J, damping: -J.T @ r,
                    "That is the gradient of the cost, downhill; the curvature JᵀJ is missing.",
                    id="damped-gradient",
                ),
                Mistake(
                    lambda r, J, damping: -J.T @ r / (1 + damping),
                    "That is the gradient of the cost, downhill, over 1 + λ; the curvature JᵀJ is missing.",
                    id="damped-gradient-shortened",
                ),
                Mistake(
                    lambda r, J, damping: -(J.T @ J + damping * np.eye(J.shape[1])) @ J.T @ r,
                    "You multiplied by JᵀJ + λ I instead of solving with it.",
                    id="damped-times",
                ),
                Mistake(
                    lambda r, J, damping: -np.linalg.solve(J.T @ J + damping, J.T @ r),
                    "The number λ is added to all entries of JᵀJ. It belongs to the diagonal: λ times `np.eye(n)`.",
                    id="damped-everywhere",
                ),
                Mistake(
                    lambda r, J, damping: opt.damped_step(r, J, damping**2),
                    "λ counts squared. In the normal equations stands λ I, and √λ I beneath J, for those who solve by least squares.",
                    id="damped-squared",
                ),
                Mistake(
                    lambda r, J, damping: opt.damped_step(r, J, np.sqrt(damping)),
                    "The root of λ counts in place of λ. In the normal equations stands λ I, and √λ I beneath J, for those who solve by least squares.",
                    id="damped-root",
                ),
                Mistake(
                    lambda r, J, damping: opt.damped_step(r, J, damping / 2),
                    "λ counts half. Both terms have the same factor: the gradient is 2Jᵀ(r + J h) + 2λ h.",
                    id="damped-half",
                ),
                Mistake(
                    lambda r, J, damping: opt.damped_step(r, J, 2 * damping),
                    "λ counts twice. Both terms have the same factor: the gradient is 2Jᵀ(r + J h) + 2λ h.",
                    id="damped-twice",
                ),
                Mistake(
                    lambda r, J, damping: -np.linalg.solve(J.T @ J - damping * np.eye(J.shape[1]), J.T @ r),
                    "The damping is subtracted. It is added: JᵀJ + λ I.",
                    id="damped-minus",
                ),
                Mistake(
                    lambda r, J, damping: -np.linalg.solve(J.T @ J + damping * np.diag(np.diag(J.T @ J)), J.T @ r),
                    "Your damping is scaled with the diagonal of JᵀJ, as Marquardt has it. Here |h|² has one price for all: λ I.",
                    id="damped-marquardt",
                ),
                Mistake(
                    lambda r, J, damping: opt.damped_step(r, J, damping * (J * J).sum() / J.shape[1]),
                    "Your damping is scaled with the mean of the diagonal of JᵀJ. Here |h|² has one price, whatever J is: λ I.",
                    id="damped-trace",
                ),
                Mistake(
                    lambda r, J, damping: opt.gauss_newton_step(r, J) / (1 + damping),
                    "You shortened the step of Gauss and Newton. How much λ shortens it depends on J, and with several unknowns λ mostly turns it as well: λ I is added to JᵀJ before solving.",
                    id="damped-shortened",
                ),
                Mistake(
                    lambda r, J, damping: -(J.T @ r) / ((J * J).sum(0) + damping),
                    "Only the diagonal of JᵀJ is used. The columns of J need not be perpendicular: solve with the whole matrix, JᵀJ + λ I.",
                    id="damped-diagonal",
                ),
                Mistake(
                    lambda r, J, damping: opt.gauss_newton_step(r[: J.shape[1]], J[: J.shape[1]]),
                    "You used as many residuals as there are unknowns, and no damping. All residuals count: (JᵀJ + λ I) h = −Jᵀr.",
                    id="damped-first-rows",
                ),
                Mistake(
                    lambda r, J, damping: r + J @ opt.damped_step(r, J, damping),
                    "These are the residuals that the model leaves. Return the step h.",
                    id="damped-residuals",
                ),
            ],
        ),
        Exercise(
            "gain_ratio",
            reference=opt.gain_ratio,
            sizes=("cost new_cost", "g", "B", "step"),
            draw=TRIED_STEPS,
            fixed={"g": TWO, "B": TWO, "step": TWO},
            metric=metrics.Numbers(1e-8),
            noisy=[(draw, metrics.Numbers(1e-8), words) for draw, words in SPECIAL_STEPS],
            draws=6,
            hints=(
                "Compare what the step brought with what the model promised, equation (2-36).",
                "Actual: cost − new_cost. Promised: m(0) − m(h) with m(h) = cost + gᵀh + ½ hᵀB h.",
                "`return (cost - new_cost) / -(g @ step + 0.5 * step @ B @ step)`",
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
                    "Only the linear term is promised here: the curvature ½ hᵀB h is missing.",
                ),
                Mistake(
                    lambda cost, new_cost, g, B, step: (cost - new_cost) / abs(_predicted(g, B, step)),
                    "Right where the model promises a decrease. Where it promises a rise, the predicted decrease is below 0: −(gᵀh + ½ hᵀB h), whatever its sign, and not its absolute value.",
                    id="gain-absolute-promise",
                ),
                Mistake(
                    lambda cost, new_cost, g, B, step: (new_cost - cost) / _predicted(g, B, step),
                    "The sign is wrong: a step that lowers the cost as promised has gain +1.",
                ),
                Mistake(
                    lambda cost, new_cost, g, B, step: (cost - new_cost) / _predicted(g, B, step, half=-0.5),
                    "The promised decrease m(0) − m(h) changes the sign of both terms, of ½ hᵀB h too.",
                ),
                Mistake(
                    lambda cost, new_cost, g, B, step: abs(cost - new_cost) / _predicted(g, B, step),
                    "A step that raised the cost has a negative gain: no absolute value, or it may be taken.",
                    id="gain_ratio-4a94e8",
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
                    lambda cost, new_cost, g, B, step: (cost - new_cost) / cost,
                    "You divide by the cost. The gain compares with what the model promised, m(0) − m(h).",
                    id="gain-of-cost",
                ),
                Mistake(
                    lambda cost, new_cost, g, B, step: (cost - new_cost) / _predicted(g, np.diag(np.diag(B)), step),
                    "Only the diagonal of B is used, as by `np.diag(B) @ step**2`: the term is ½ hᵀB h, `step @ B @ step`.",
                    id="gain-diagonal",
                ),
                Mistake(
                    lambda cost, new_cost, g, B, step: (cost - new_cost) / (0.5 * step @ B @ step),
                    "The linear term of the model is missing: it promises −gᵀh − ½ hᵀB h.",
                    id="gain-no-slope",
                ),
                Mistake(
                    lambda cost, new_cost, g, B, step: (cost - new_cost) / -(0.5 * step @ B @ step),
                    "The linear term of the model is missing: it promises −gᵀh − ½ hᵀB h.",
                    id="gain-no-slope-minus",
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
                Mistake(
                    lambda cost, new_cost, g, B, step: (cost - new_cost) / (cost + _predicted(g, B, step)),
                    "The promised decrease has the cost added to it. It is m(0) − m(h), in which the cost cancels.",
                    id="gain-cost-added",
                ),
                Mistake(
                    lambda cost, new_cost, g, B, step: new_cost / cost,
                    "This is the ratio of the costs. The gain is the actual decrease over the promised one.",
                    id="gain-of-costs",
                ),
                Mistake(
                    lambda cost, new_cost, g, B, step: cost - new_cost - _predicted(g, B, step),
                    "This is the difference of both decreases. The gain is their ratio: actual over promised.",
                    id="gain-difference",
                ),
                Mistake(
                    lambda cost, new_cost, g, B, step: max(0.0, (cost - new_cost) / _predicted(g, B, step)),
                    "A step that raised the cost has a negative gain; here it is cut off at 0.",
                    id="gain-cut",
                ),
                Mistake(
                    lambda cost, new_cost, g, B, step: (cost - new_cost) / -(g @ step + 0.5 * g @ B @ g),
                    "The curvature term holds g twice. It is ½ hᵀB h, with the step.",
                    id="gain-gBg",
                ),
                Mistake(
                    lambda cost, new_cost, g, B, step: (cost - new_cost) / _predicted(g, B, step, half=2.0),
                    "The quadratic term of the model carries a factor ½; here it is 2.",
                    id="gain-twice",
                ),
            ],
        ),
        Exercise(
            "dogleg_step",
            reference=opt.dogleg_step,
            sizes=("g", "B", "radius"),
            draw=DOGLEG_CASES,
            metric=metrics.Numbers(1e-8),
            noisy=[
                (functools.partial(straight_path, share=share), metrics.Numbers(1e-8), f"right, but not where {words}:")
                for share, words in ((0.6, "B is alike in all directions"), (1.4, "B is alike in all directions"))
            ]
            + [(draw, metrics.Numbers(1e-8), words) for draw, words in BESIDE_THE_RIM]
            + [(draw, metrics.Numbers(1e-8, least=0.0), words) for draw, words in SPECIAL_DOGLEGS],
            draws=16,
            fixed={"g": TWO, "B": TWO},
            hints=(
                "Three cases: the Newton point is inside; the corner is outside; the rim cuts the second leg. The corner is −(gᵀg / gᵀBg) g. "
                "On the second leg solve |corner + s (newton − corner)| = radius for s between 0 and 1.",
                "Compute `newton` and `corner` first. If |newton| ≤ radius, return newton. If |corner| ≥ radius, return the vector of length "
                "radius along −g. Otherwise `leg = newton - corner`, and with a = legᵀleg, b = cornerᵀleg, c = cornerᵀcorner − radius² return "
                "corner + s leg with s = (−b + √(b² − ac))/a.",
                "`newton, corner = np.linalg.solve(B, -g), -(g @ g) / (g @ B @ g) * g\nif np.linalg.norm(newton) <= radius:\n    return newton\n"
                "if np.linalg.norm(corner) >= radius:\n    return -radius * g / np.linalg.norm(g)\nleg = newton - corner\n"
                "a, b, c = leg @ leg, corner @ leg, corner @ corner - radius**2\nreturn corner + (-b + np.sqrt(b * b - a * c)) / a * leg`",
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
                    _wrong_comparison,
                    "You compare |newton|² with the radius: `newton @ newton` is the square of the length. Take the root, or square the radius.",
                    id="dogleg-square",
                ),
                Mistake(
                    _dogleg(rim_term=lambda radius: radius),
                    "On the second leg the radius is to be squared: c = cornerᵀcorner − radius².",
                    id="dogleg-root-of-radius",
                ),
                Mistake(
                    _dogleg(share=lambda a, b, c: np.nan),
                    "NaN on the second leg: is it the root of a negative number? It is b² − ac with c = cornerᵀcorner − radius², which is "
                    "negative there, so that b² − ac is positive.",
                    id="dogleg-nan",
                ),
                Mistake(
                    _newton_or_rim,
                    "Between corner and Newton point the rim cuts the second leg; you run straight downhill to the rim. "
                    "Your corner must not lie too far out either: it is −(gᵀg / gᵀBg) g.",
                    id="dogleg_step-e3d2ea",
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
                    _leg_by_shares,
                    "Your s takes |corner + s leg| as growing evenly with s. Its square is quadratic in s: solve |corner + s leg|² = radius².",
                    id="dogleg-shares",
                ),
                Mistake(
                    _lowest_within,
                    "This is the lowest point of the model within the radius. The dogleg only comes near it, on two straight legs: "
                    "to the corner, then toward Newton.",
                    id="dogleg-lowest",
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
                    "Your result is always the point at the rim straight downhill. Where the corner or the Newton point lies within the radius, the path bends or ends there.",
                ),
                Mistake(
                    _dogleg(share=lambda a, b, c: (-b - np.sqrt(b * b - a * c)) / a),
                    "Your step leaves the corner backward, away from the Newton point. Take the root with + before the square root, and "
                    "newton − corner for the leg.",
                    "dogleg_step-0db7c2",
                ),
                Mistake(
                    _dogleg(share=lambda a, b, c: (-b + np.sqrt(b * b - 4 * a * c)) / (2 * a)),
                    "The equation is a s² + 2 b s + c = 0, its middle term holds the 2 already: s = (−b + √(b² − ac))/a.",
                ),
                Mistake(
                    _dogleg(leg=lambda n, p: n), "The second leg is newton − corner; yours is the whole Newton step."
                ),
                Mistake(_dogleg(corner=lambda p: -p), "Your corner lies uphill: it is −(gᵀg / gᵀBg) g."),
                Mistake(_dogleg(full=lambda n: -n), "Your Newton point has the wrong sign: it solves B h = −g."),
                Mistake(_leg_from_zero, "The second leg starts at the corner: add corner to s times the leg."),
                Mistake(
                    _corner_or_newton,
                    "Where the rim cuts the second leg you stop at the corner. Go on toward the Newton point, as far as the radius lets you.",
                    id="dogleg-stops",
                ),
                Mistake(
                    _dogleg(
                        share=lambda a, b, c: (-b + np.sqrt(max(0.0, b * b - a * c))) / a, rim_term=lambda r: -(r**2)
                    ),
                    "In c the radius is subtracted: c = pᵀp − Δ², so that p + s l lies on the rim.",
                    id="dogleg-c-sign",
                ),
                Mistake(
                    _dogleg(share=lambda a, b, c: (-b + np.sqrt(max(0.0, b * b - a * c))) / a, rim_term=lambda r: r),
                    "In c the radius is to be squared: c = pᵀp − Δ².",
                    id="dogleg-c-radius",
                ),
                Mistake(
                    _dogleg(corner=lambda p: p / np.linalg.norm(p), leg=None),
                    "Your corner has length 1. It is the lowest point downhill: p = −(gᵀg / gᵀB g) g.",
                    id="dogleg-unit-corner",
                ),
                Mistake(
                    lambda g, B, radius: _dogleg(corner=lambda p: p / (g @ g))(g, B, radius),
                    "gᵀg is missing in your corner: p = −(gᵀg / gᵀB g) g.",
                    id="dogleg-corner-gg",
                ),
                Mistake(
                    lambda g, B, radius: _dogleg(corner=lambda p: -g)(g, B, radius),
                    "Your corner is −g. B belongs to it, too: the lowest point downhill is p = −(gᵀg / gᵀB g) g.",
                    id="dogleg-corner-g",
                ),
                Mistake(
                    lambda g, B, radius: np.clip(opt.newton_step(g, B), -radius, radius),
                    "This is the Newton step with each entry cut off at the radius, in a square: it is longer than the radius in places, and has no bend. "
                    "The dogleg goes downhill first, then toward the Newton point.",
                    id="dogleg-box",
                ),
                Mistake(
                    _dogleg(share=lambda a, b, c: (-2 * b + np.sqrt(4 * b * b - a * c)) / a),
                    "b is pᵀl, without a 2: the formula for s has taken the factors out.",
                    id="dogleg-2b",
                ),
            ],
        ),
        Exercise(
            "trust_region",
            reference=beyond.trust_region,
            draw=beyond.RUNS,
            metric=ITERATE,
            noisy=[
                (draw, ITERATE, words)
                for draw, words in (
                    (beyond.no_rounds, "right, but not for no rounds at all:"),
                    (
                        beyond.residuals_that_are_x,
                        "right, but not where `residual` returns the very x that it is given (is that x changed before the "
                        "residuals are used?):",
                    ),
                    *beyond.AT_THE_LIMITS,
                )
            ]
            + [(draw, ITERATE_OF_ANY_SIZE, words) for draw, words in beyond.OF_ANOTHER_SIZE],
            draws=5,
            hints=(
                "Each round: residuals and Jacobian where you stand, a dogleg step, its gain ratio; then decide twice, whether to take the step and what the radius becomes.",
                "g = Jᵀr and B = JᵀJ, with the cost ½ rᵀr before and after. Take the step where ρ > 0.1. The radius becomes a quarter of the step's length where ρ < ¼, "
                "doubles where ρ > ¾ and the step is longer than 0.999 of it, and stays otherwise, whether or not the step was taken.",
                "`for _ in range(steps):\n    r, J = residual(x), jacobian(x)\n    g, B = J.T @ r, J.T @ J\n    step = dogleg_step(g, B, radius)\n"
                "    new, length = residual(x + step), np.linalg.norm(step)\n    rho = gain_ratio(r @ r / 2, new @ new / 2, g, B, step)\n"
                "    if rho > 0.1:\n        x = x + step\n    if rho < 0.25:\n        radius = length / 4\n"
                "    elif rho > 0.75 and length > 0.999 * radius:\n        radius = 2 * radius\nreturn x, radius`",
            ),
            mistakes=[
                Mistake(
                    beyond.loop(keep=lambda rho: True),
                    "You take every step. Where ρ is not above 0.1 the step is taken back: x stays, and only the radius changes.",
                    id="region-always",
                ),
                Mistake(
                    beyond.loop(keep=lambda rho: rho > 0),
                    "You also take steps that lower the cost by little. The rule asks for more: ρ > 0.1.",
                    id="region-any-decrease",
                ),
                Mistake(
                    beyond.loop(keep=lambda rho: rho > beyond.POOR),
                    "You take a step only above ¼. Between 0.1 and ¼ it is taken, and the radius shrinks all the same.",
                    id="region-quarter",
                ),
                Mistake(
                    beyond.loop(follow=lambda radius, length, rho: radius),
                    "Your radius never changes: a quarter of the step's length below ¼, twice the radius above ¾ at the rim.",
                    id="region-fixed",
                ),
                Mistake(
                    beyond.loop(
                        follow=lambda radius, length, rho: (
                            radius / 4 if rho < beyond.POOR else beyond.rule(radius, length, rho)
                        )
                    ),
                    "After a poor step the radius becomes a quarter of the step's length. A quarter of the radius may still be longer than that step.",
                    id="region-quarter-of-radius",
                ),
                Mistake(
                    beyond.loop(
                        follow=lambda radius, length, rho: (
                            length / 4 if rho < beyond.POOR else 2 * radius if rho > beyond.GOOD else radius
                        )
                    ),
                    "You double the radius after every good step. A step that ended inside says nothing about the rim: ask for its length as well.",
                    id="region-no-rim",
                ),
                Mistake(
                    beyond.loop(
                        follow=lambda radius, length, rho: (
                            length / 4 if rho < beyond.ACCEPT else beyond.rule(radius, length, max(rho, beyond.POOR))
                        )
                    ),
                    "Your radius shrinks only where the step is taken back. It shrinks below ¼, after steps that were taken too.",
                    id="region-shrinks-late",
                ),
                Mistake(
                    beyond.loop(follow=functools.partial(beyond.rule, good=0.9)),
                    "After some steps to the rim whose ρ is above ¾ your radius does not double. It does after each of them.",
                    id="region-nine-tenths",
                ),
                Mistake(
                    beyond.loop(weight=1.0),
                    "Your gain ratios are twice as large as they should be: the cost is ½ rᵀr, to which g = Jᵀr and B = JᵀJ belong.",
                    id="region-cost",
                ),
                Mistake(
                    beyond.loop(stale=True),
                    "J is computed once, at the start. It belongs to where you stand: compute it in every round.",
                    id="region-stale",
                ),
                Mistake(
                    beyond.slope_of_the_next,
                    "Your gain ratios take g of where the step ends. What the model promises is told by g and B of where it begins.",
                    id="region-next-slope",
                ),
                Mistake(
                    beyond.cost_of_the_start,
                    "You compare every new cost with that of the start. The gain of a step is counted from where it begins: take the cost anew in each round.",
                    id="region-first-cost",
                ),
                Mistake(
                    beyond.loop(
                        follow=lambda radius, length, rho: (
                            beyond.rule(radius, length, rho) if rho > beyond.ACCEPT else radius
                        )
                    ),
                    "Your radius changes only where the step is taken. After one that is taken back it must shrink, or the same step is tried again.",
                    id="region-only-taken",
                ),
                Mistake(
                    beyond.until_rejected,
                    "You stop at the first step that is taken back. It shrinks the radius, and the next round tries a shorter one: go on for all rounds.",
                    id="region-stops",
                ),
                Mistake(
                    beyond.loop(step_of=opt.cauchy_step),
                    "Your steps end at the Cauchy point, on the way down the gradient. Take `dogleg_step`, both legs.",
                    id="region-cauchy",
                ),
                Mistake(
                    beyond.loop(step_of=lambda g, B, radius: opt.newton_step(g, B)),
                    "Your steps ignore the radius: take `dogleg_step(g, B, radius)`.",
                    id="region-newton",
                ),
                Mistake(
                    lambda residual, jacobian, x, radius, steps: beyond.descend(
                        residual, jacobian, x, radius, steps + 1
                    ),
                    "You try one step too many: `steps` counts those taken back as well.",
                    id="region-one-more",
                ),
                Mistake(
                    beyond.only_taken_count,
                    "You count only the steps that are taken. `steps` counts rounds, those whose step is taken back as well.",
                    id="region-taken-rounds",
                ),
                Mistake(
                    lambda residual, jacobian, x, radius, steps: beyond.descend(residual, jacobian, x, radius, 1),
                    "This is where the first round ends: is the `return` inside the loop?",
                    id="region-one-round",
                ),
                Mistake(
                    beyond.loop(
                        follow=lambda radius, length, rho: (
                            2 * beyond.rule(radius, length, rho)
                            if rho > 0.75 and length > 0.999 * radius
                            else beyond.rule(radius, length, rho)
                        )
                    ),
                    "After a good step at the rim your radius becomes four times as large: it doubles.",
                    id="trust-fourfold",
                ),
                Mistake(
                    beyond.loop(
                        follow=lambda radius, length, rho: (
                            length / 2 if rho < 0.25 else beyond.rule(radius, length, rho)
                        )
                    ),
                    "After a poor step your radius becomes half of the step's length: it is a quarter.",
                    id="trust-half",
                ),
                *(
                    Mistake(beyond.loop(follow=rule), words, id=f"trust-rule-{k}")
                    for k, words, rule in beyond.other_radii()
                ),
                Mistake(
                    beyond.loop(follow=lambda radius, length, rho: length / 4 if rho < 0.25 else 2 * radius),
                    "Your radius doubles after every step that is not poor. It doubles above ¾ and at the rim, otherwise it stays.",
                    id="trust-else-doubles",
                ),
                Mistake(
                    beyond.loop(follow=functools.partial(beyond.rule, good=beyond.POOR)),
                    "Your radius doubles also after steps to the rim whose ρ is below ¾. Between ¼ and ¾ it stays.",
                    id="trust-rim-alone",
                ),
                Mistake(
                    beyond.never_looked_again,
                    "Residuals and Jacobian are those of the start in every round. Compute both where you stand, inside the loop.",
                    id="trust-start",
                ),
                Mistake(
                    beyond.model_of_the_start,
                    "g and B are those of the start in every round. Compute both where you stand, inside the loop.",
                    id="trust-model-of-the-start",
                ),
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
            rtol=5e-3,
            hints=(
                "First one stand-in: four tosses, all of them right.",
                "At least one of five is the opposite of none of five.",
                "`one = 0.5**4  # all four landings of one stand-in\nluck = 1 - (1 - one)**5`",
            ),
            mistakes=[
                Mistake(lambda: 0.5**4, "That is one stand-in by itself. Five were tried."),
                Mistake(
                    lambda: 5 * 0.5**4 * (1 - 0.5**4) ** 4,
                    "That is the probability that exactly one of the five is right. Two or more count as well.",
                    id="luck-exactly-one",
                ),
                Mistake(
                    lambda: 5 * 0.5**4 * (1 - 0.5**4) ** 4 + 10 * 0.5**8 * (1 - 0.5**4) ** 3,
                    "That is the probability that one or two of the five are right. Three and more count as well.",
                    id="luck-one-or-two",
                ),
                Mistake(
                    lambda: 1 - 0.5**5,
                    "That is one landing, tried five times. A stand-in must have all four landings right: p = ½⁴.",
                    id="luck-one-landing",
                ),
                Mistake(
                    lambda: 1 - (1 - 1 / 3**4) ** 5,
                    "This gives each landing three outcomes. The toss has two, L or G.",
                    id="luck-three-sides",
                ),
                Mistake(
                    lambda: 5 * 0.5**4,
                    "This is five times ½⁴. Adding up counts those cases several times where more than one stand-in is right.",
                    id="luck-e6d3d2",
                ),
                Mistake(lambda: (1 - 0.5**4) ** 5, "That is the probability that none of the five is right."),
                Mistake(
                    lambda: (1 - 0.5**5) ** 4,
                    "That each landing is right for some stand-in or other is more likely: here one and the same must have all four right.",
                    id="luck-each-by-some",
                ),
                Mistake(
                    lambda: 1 - (1 - 0.5**5) ** 4, "Four and five are exchanged: four landings each, five stand-ins."
                ),
                Mistake(
                    lambda: 100 * wells.luck(), "Right, in percent: give the probability as a number between 0 and 1."
                ),
                Mistake(
                    lambda: 1 - 0.5**20,
                    "That is the probability that at least one of all twenty landings is right. A stand-in must have all four right: p = ½⁴.",
                    id="luck-any-landing",
                ),
                Mistake(
                    lambda: 0.5**20,
                    "That is the probability that all five stand-ins have all landings right. One is enough.",
                    id="luck-40ab53",
                ),
                Mistake(
                    lambda: 1 - (15 / 16) ** 4,
                    "This tries four stand-ins. Five were tried, with four landings each.",
                    id="luck-four",
                ),
                Mistake(
                    lambda: 15 / 16,
                    "That is the probability that one stand-in has not all landings right. Five were tried; at least one is to have them.",
                    id="luck-one-wrong",
                ),
                Mistake(
                    lambda: 5 / 16 - 10 / 256,
                    "This is the sum of all chances, less that of ten pairs. Where three stand-ins are right, too much is taken off: go by none of five.",
                    id="luck-pairs",
                ),
                Mistake(
                    lambda: 5 / 32,
                    "That is the toss of five coins, four of them right. Each stand-in has four landings, all to be right, and five are tried.",
                    id="luck-four-of-five",
                ),
            ],
        ),
        Prediction(
            "share",
            question="From what share of the starts in the square from −6 to 6 does Newton reach one of the two minima?",
            choices=("less than 1 %", "about 10 %", "about half"),
            answer="less than 1 %",
            why="0.7 % end in a minimum, 2.8 % in the saddle, all others run away across the plain.",
        ),
        Value(
            "tipping_weight",
            reference=beyond.tipping_weight,
            rtol=2e-3,
            hints=(
                "Write both sums with w in front of the last criterion; the first three count once.",
                "9 + 8 + 6 + 3 w = 3 + 3 + 8 + 8 w. Solve for w.",
                "`tipping_weight = ((9 + 8 + 6) - (3 + 3 + 8)) / (8 - 3)`",
            ),
            mistakes=[
                Mistake(
                    lambda: beyond.tipping_weight() - 1,
                    "That is by how much the weight must grow. Asked for is the weight itself, 1 in the printed sum.",
                    id="tipping-growth",
                ),
                Mistake(
                    lambda: 1.0,
                    "With 1 all criteria count alike, as in the printed sums: there the sphere wins, 26 to 22.",
                    id="tipping-printed",
                ),
                Mistake(
                    lambda: 1 / beyond.tipping_weight(),
                    "Upside down: that is the weight of the other three, when solving counts once.",
                    id="tipping-inverse",
                ),
                Mistake(
                    lambda: beyond.tipping_weight("sphere", "laser tracker"),
                    "That is where the laser tracker draws level with the sphere. Asked for is the cube.",
                    id="tipping-tracker",
                ),
                Mistake(
                    lambda: beyond.tipping_weight(criteria=(2, 3)),
                    "That is the weight of taking the data and solving together. Only solving, the last criterion, counts w times.",
                    id="tipping-both",
                ),
                Mistake(
                    lambda: beyond.tipping_weight(criteria=(2,)),
                    "At 3 both draw level if taking the data, the third criterion, is weighted. Asked for is the weight of solving, the last one, and not rounded.",
                    id="tipping-third",
                ),
                *(
                    Mistake(
                        lambda one=one, other=other: one / other,
                        "That is the ratio of two sums. The weight stands in front of one criterion, on both sides.",
                        id=id,
                    )
                    for one, other, id in (
                        (26, 22, "tipping-ratio"),
                        (22, 26, "tipping-ratio-inverse"),
                        (26, 16, "tipping-ratio-to-the-least"),
                    )
                ),
                Mistake(
                    lambda: 26 - 22,
                    "That is by how much the sphere leads. How much of it does each further unit of w win back?",
                    id="tipping-lead",
                ),
                Mistake(
                    lambda: (26 - 22) / 14,
                    "That is the lead over the cube's other points. What wins it back is the gap in the last criterion, 8 − 3.",
                    id="tipping-lead-14",
                ),
                Mistake(
                    lambda: (9 + 8 + 6) / (3 + 3 + 8),
                    "The ratio of the other points decides nothing: the weight multiplies the last criterion, on both sides.",
                    id="tipping-ratio-of-others",
                ),
                Mistake(
                    lambda: (9 + 8 + 6) - (3 + 3 + 8),
                    "That is the lead of the sphere in the three other criteria. Divide it by the cube's lead in solving, 8 − 3.",
                    id="tipping-nine",
                ),
                Mistake(
                    lambda: 9 / (8 + 3),
                    "The lead in the other criteria is divided by a sum. What w multiplies is the difference in solving, 8 − 3.",
                    id="tipping-sum",
                ),
                Mistake(
                    lambda: 1 + beyond.tipping_weight(),
                    "One too many. Is w added to the weight 1 of the printed sum, which it replaces? Or are the sphere's points, 9 + 8 + 6, left out?",
                    id="tipping-plus-one",
                ),
                Mistake(
                    lambda: beyond.tipping_weight() / (beyond.tipping_weight() + 3),
                    "That is 3/8, the ratio of the points for solving, and also w / (w + 3), the share of all weights that w has. Asked for is w, beside three weights of 1.",
                    id="tipping-share",
                ),
                Mistake(
                    lambda: beyond.tipping_weight() / 3,
                    "That is a third of the weight. The three other criteria are added up, in both sums: no mean is taken of them.",
                    id="tipping-mean",
                ),
                Mistake(
                    lambda: 8 / 3,
                    "That is the ratio of the points for solving. The other three criteria count as well, once each.",
                    id="tipping-ratio-of-solving",
                ),
                Mistake(
                    lambda: 2,
                    "With 2 the cube has won already, 30 to 29. Asked for is the weight at which both draw level.",
                    id="tipping-two",
                ),
            ],
        ),
    ],
    title="Optimization",
    further=(
        "convex_share",
        "rise_above_chord",
        "trust_region",
        "luck",
        "share",
        "tipping_weight",
    ),
)
