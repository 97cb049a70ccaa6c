"""Draws, references and wrong variants of four exercises of chapter 4, too long to stand among its items.

The measured gradient, the chord, the trust-region loop, and the weights behind the choice of a way to calibrate.
"""

import functools
import itertools

import numpy as np

from ...documents.thesis import printed as thesis
from ...documents.thesis import wells
from ...estimation.convexity import chord
from ...estimation.differences import numeric_jacobian

# --- a measured gradient ---


def wavy(rng, n=None):
    """A curved function of some variables, their number, and a place."""
    n = n or int(rng.integers(2, 6))
    M, c = rng.normal(size=(3, n)), rng.normal(size=n)
    return (lambda x: float(np.sin(M @ x).sum() + c @ x**2)), rng.normal(size=n)


def function_and_step(rng, n=None, step=(0.03, 0.08)):
    """A function, a place, and a step large enough to tell the schemes apart."""
    return *wavy(rng, n), float(rng.uniform(*step))


def sized(f, size):
    """A function so many times as large."""
    return lambda x: size * f(x)


def faint_function_and_step(rng):
    """The same, of a function that hardly changes at all."""
    f, x, h = function_and_step(rng)
    return sized(f, 1e-7), x, h


def far_and_step(rng):
    """The same, far from 0, where a step that grows with x would be another one."""
    f, x, h = function_and_step(rng)
    return f, x + 20 * rng.choice([-1, 1], len(x)), h


def some_at_nought(rng):
    """The same at a place of which some unknowns are 0."""
    f, x, h = function_and_step(rng)
    x[: len(x) - 1] = 0
    return f, rng.permutation(x), h


MEASURED = (  # draw, tolerance, least size it is relative to, words
    (functools.partial(function_and_step, n=1), 1e-9, 1.0, "right, but not for a function of one unknown:"),
    (functools.partial(function_and_step, n=8), 1e-9, 1.0, "right, but not for a function of eight unknowns:"),
    (functools.partial(function_and_step, step=(3e-5, 1e-4)), 1e-8, 1.0, "right, but not with a step below 1e-4:"),
    (functools.partial(function_and_step, step=(1, 3)), 1e-9, 1.0, "right, but not with a step above 1:"),
    (far_and_step, 1e-9, 1.0, "right, but not far from 0:"),
    (some_at_nought, 1e-9, 1.0, "right, but not where unknowns are 0:"),
    (faint_function_and_step, 1e-7, 0.0, "right, but not for a function that hardly changes, its slopes below 1e-5:"),
)


def measured_gradient(f, x, h):
    """Reference of the exercise: central differences, one variable after the other."""
    return numeric_jacobian(lambda y: np.atleast_1d(f(y)), x, h)[0]


def differences(difference):
    """A gradient by some other difference of f, x and one step e along an axis."""

    def variant(f, x, h):
        return np.array([difference(f, x, e, h) for e in h * np.eye(len(x))])

    return variant


def not_put_back(f, x, h):
    """Leaves each step in place when the next variable is moved."""
    here, slopes = x.copy(), []
    for k in range(len(x)):
        here[k] += h
        ahead = f(here)
        here[k] -= 2 * h
        slopes.append((ahead - f(here)) / (2 * h))
    return np.array(slopes)


def neither_put_back(f, x, h):
    """Moves one place ahead and one behind, each farther with every variable."""
    return np.array([(f(x + h * moved) - f(x - h * moved)) / (2 * h) for moved in np.tri(len(x))])


# --- a chord ---


def bowl(rng):
    """A convex function and the two ends of a chord."""
    n = int(rng.integers(2, 5))
    A, c = rng.normal(size=(n + 1, n)), rng.normal(size=n)
    return (lambda x: float(((A @ (x - c)) ** 2).sum())), *rng.normal(scale=2.0, size=(2, n)), int(rng.integers(5, 40))


def hilly(rng, falls, unknowns=None, places=(6, 20), across=False):
    """A function that rises above its chord off the middle, from its higher end or to it, and sags elsewhere, more than
    it rises where it falls. across: both ends have the same first coordinate.
    """
    while True:
        f, x = wavy(rng, unknowns)
        y, n = x + rng.normal(scale=1.5, size=len(x)), int(rng.integers(*places))
        y[0] = x[0] if across else y[0]
        _, values, heights = chord(f, x, y, n)
        gap = values - heights
        off_middle = gap.max() - gap[n // 2] > 0.05 * gap.max() and 1 < np.argmax(gap) < n - 2
        deeper = -gap.min() > 1.2 * gap.max() if falls else 0.05 < -gap.min() < 0.8 * gap.max()
        if gap.max() > 0.2 and off_middle and deeper and (values[0] > values[-1]) == falls:
            return f, x, y, n


def both_ends(rng):
    """A chord of which no place but its ends is looked at: nothing rises above it there, though the middle does."""
    while True:
        f, x, y, _ = hilly(rng, falls=bool(rng.integers(2)))
        if f((x + y) / 2) - (f(x) + f(y)) / 2 > 0.05:
            return f, x, y, 2


def three_places(rng):
    """A chord of which the ends and the middle are looked at."""
    return *both_ends(rng)[:3], 3


def one_place(rng):
    """A chord whose ends are one place, so that nothing rises."""
    f, x, _, n = hilly(rng, falls=True)
    return f, x, x.copy(), n


def sized_hills(rng, size):
    """A chord of a function so many times as large."""
    f, *others = hilly(rng, falls=bool(rng.integers(2)))
    return sized(f, size), *others


def two_hills(rng):
    """A chord above which the function rises twice, and comes down to it between: the larger rise comes second."""
    while True:
        f, x = wavy(rng)
        y, n = x + rng.normal(scale=2.5, size=len(x)), int(rng.integers(12, 25))
        _, values, heights = chord(f, x, y, n)
        gap = values - heights
        best = int(np.argmax(gap))
        valley = int(np.argmin(gap[:best])) if best else 0
        if valley and 0.1 < gap[:valley].max(initial=0.0) < 0.8 * gap[best] and gap[valley] < -0.05:
            return f, x, y, n


ONE_TOO_MANY = [n for n in range(6, 40) if len(np.arange(0, 1 + 1 / (n - 1), 1 / (n - 1))) > n]


def rising_behind_the_end(rng):
    """A chord behind whose end the function rises more than anywhere above it, and so many places that steps of
    1 / (n - 1), as of `np.arange`, may by rounding go one too far.
    """
    while True:
        f, x = wavy(rng)
        y, n = x + rng.normal(scale=1.5, size=len(x)), int(rng.choice(ONE_TOO_MANY))
        _, values, heights = chord(f, x, y, n)
        t = n / (n - 1)
        if f((1 - t) * x + t * y) - (1 - t) * values[0] - t * values[-1] > (values - heights).max() + 0.05:
            return f, x, y, n


CHORDS = (  # draw, tolerance, least size it is relative to, words
    (both_ends, 1e-9, 1.0, "right, but not where both ends alone are looked at:"),
    (three_places, 1e-9, 1.0, "right, but not where three places are looked at:"),
    (functools.partial(hilly, falls=False, places=(200, 400)), 1e-9, 1.0, "right, but not for hundreds of places:"),
    (functools.partial(hilly, falls=False, unknowns=1), 1e-9, 1.0, "right, but not for a function of one unknown:"),
    (
        functools.partial(hilly, falls=False, unknowns=3, across=True),
        1e-9,
        1.0,
        "right, but not where x and y have the same first coordinate:",
    ),
    (one_place, 1e-9, 1.0, "right, but not where x and y are one place:"),
    (two_hills, 1e-9, 1.0, "right, but not where f rises above the chord twice, and more the second time:"),
    (
        rising_behind_the_end,
        1e-9,
        1.0,
        "right, but not where f rises on behind y (is a place looked at that lies behind the end?):",
    ),
    (functools.partial(sized_hills, size=1e-9), 1e-5, 0.0, "right, but not where f rises by some 1e-9 only:"),
    (functools.partial(sized_hills, size=1e6), 1e-9, 1.0, "right, but not where f rises by hundreds of thousands:"),
)


def chords(rise):
    """Something else made of share, values and heights of a chord."""
    return lambda f, x, y, n: float(rise(*chord(f, x, y, n)))


def other_places(places):
    """The rise over other shares of the way than the n asked for."""

    def variant(f, x, y, n):
        return float(max(f((1 - t) * x + t * y) - (1 - t) * f(x) - t * f(y) for t in places(n)))

    return variant


# --- the trust-region loop ---

ACCEPT, POOR, GOOD, RIM = 0.1, 0.25, 0.75, 0.999


def rule(radius, length, rho, good=GOOD, poor=POOR):
    """The radius after a tried step."""
    if rho < poor:
        return length / 4
    return 2 * radius if rho > good and length > RIM * radius else radius


def bare_dogleg(g, B, radius):
    """`opt.dogleg_step` on a positive definite B without its checks: a draw tries hundreds of steps."""
    newton, corner = np.linalg.solve(B, -g), -(g @ g) / (g @ B @ g) * g
    if newton @ newton <= radius**2:
        return newton
    if corner @ corner >= radius**2:
        return -radius * g / np.sqrt(g @ g)
    leg = newton - corner
    a, b, c = leg @ leg, corner @ leg, corner @ corner - radius**2
    return corner + (-b + np.sqrt(b * b - a * c)) / a * leg


def descend(residual, jacobian, x, radius, steps, *, keep=lambda rho: rho > ACCEPT, follow=rule, weight=0.5,
            step_of=bare_dogleg, stale=False, seen=None):  # fmt: skip
    """The loop of the exercise with one of its parts replaced; `seen` collects (rho, length, radius) of each step."""
    r, J = residual(x), jacobian(x)
    for _ in range(steps):
        r, J = residual(x), (J if stale else jacobian(x))
        g, B = J.T @ r, J.T @ J
        step = step_of(g, B, radius)
        new = residual(x + step)
        length = float(np.linalg.norm(step))
        rho = float(weight * (r @ r - new @ new) / -(g @ step + 0.5 * step @ B @ step))
        if seen is not None:
            seen.append((rho, length, radius))
        x = x + step if keep(rho) else x
        radius = follow(radius, length, rho)
    return x, radius


def trust_region(residual, jacobian, x, radius, steps):
    """Reference of the exercise."""
    return descend(residual, jacobian, x, radius, steps)


def loop(**changes):
    """The loop with some part replaced, as a variant of the exercise."""
    return lambda residual, jacobian, x, radius, steps: descend(residual, jacobian, x, radius, steps, **changes)


def never_looked_again(residual, jacobian, x, radius, steps):
    """The loop with the residuals and the Jacobian of the start in every round."""
    r, J = residual(x), jacobian(x)
    g, B = J.T @ r, J.T @ J
    for _ in range(steps):
        step = bare_dogleg(g, B, radius)
        new, length = residual(x + step), np.linalg.norm(step)
        rho = 0.5 * (r @ r - new @ new) / -(g @ step + 0.5 * step @ B @ step)
        x = x + step if rho > ACCEPT else x
        radius = rule(radius, length, rho)
    return x, radius


def model_of_the_start(residual, jacobian, x, radius, steps):
    """The loop with gradient and curvature of the start in every round, the cost being that of where it stands."""
    g, B = jacobian(x).T @ residual(x), jacobian(x).T @ jacobian(x)
    for _ in range(steps):
        step = bare_dogleg(g, B, radius)
        r, new, length = residual(x), residual(x + step), np.linalg.norm(step)
        rho = 0.5 * (r @ r - new @ new) / -(g @ step + 0.5 * step @ B @ step)
        x = x + step if rho > ACCEPT else x
        radius = rule(radius, length, rho)
    return x, radius


def slope_of_the_next(residual, jacobian, x, radius, steps):
    """The loop with the gradient of the next place in every gain ratio, steps and curvature being those of this one."""
    for _ in range(steps):
        r, J = residual(x), jacobian(x)
        g, B = J.T @ r, J.T @ J
        step = bare_dogleg(g, B, radius)
        new, length = residual(x + step), np.linalg.norm(step)
        promised = -(jacobian(x + step).T @ new @ step + 0.5 * step @ B @ step)
        rho = 0.5 * (r @ r - new @ new) / promised
        x = x + step if rho > ACCEPT else x
        radius = rule(radius, length, rho)
    return x, radius


def cost_of_the_start(residual, jacobian, x, radius, steps):
    """The loop with the cost of the start in every gain ratio."""
    first = residual(x) @ residual(x)
    for _ in range(steps):
        r, J = residual(x), jacobian(x)
        g, B = J.T @ r, J.T @ J
        step = bare_dogleg(g, B, radius)
        new, length = residual(x + step), np.linalg.norm(step)
        rho = 0.5 * (first - new @ new) / -(g @ step + 0.5 * step @ B @ step)
        x = x + step if rho > ACCEPT else x
        radius = rule(radius, length, rho)
    return x, radius


def until_rejected(residual, jacobian, x, radius, steps):
    """The loop, ended by the first step that is taken back."""
    for _ in range(steps):
        before = x
        x, radius = descend(residual, jacobian, x, radius, 1)
        if x is before:
            break
    return x, radius


def only_taken_count(residual, jacobian, x, radius, steps):
    """The loop, in which rounds whose step is taken back are not counted."""
    taken = 0
    for _ in range(20 * steps):
        before = x
        x, radius = descend(residual, jacobian, x, radius, 1)
        taken += x is not before
        if taken == steps:
            break
    return x, radius


def _problem(rng):
    """Residuals and their Jacobian: the two wells, or waves in two to four unknowns; and a start."""
    if rng.random() < 0.3:
        return wells.residual, wells.jacobian, rng.uniform(-8, 8, 2)
    n = int(rng.integers(2, 5))
    M, a, b = 1.5 * rng.normal(size=(n + 1, n)), rng.normal(size=n), 2 * rng.normal(size=n + 1)

    def residual(x):
        return np.concatenate([2 * np.sin(M @ x) - b, 0.5 * (x - a)])

    def jacobian(x):
        return np.vstack([2 * np.cos(M @ x)[:, None] * M, 0.5 * np.eye(n)])

    return residual, jacobian, rng.uniform(-4, 4, n)


def shrunk_where_taken_back(radius, length, rho):
    """The rule, but for steps that are poor and taken: the radius stays."""
    return radius if ACCEPT < rho < POOR else rule(radius, length, rho)


def no_praise_for_luck(radius, length, rho):
    """The rule, but for steps that bring far more than was promised: the radius stays."""
    return radius if rho > 1.6 else rule(radius, length, rho)


SHRINKS = {  # what else the radius may become after a poor step
    "a quarter of what it was": lambda radius, length: radius / 4,
    "half of what it was": lambda radius, length: radius / 2,
    "half of the step's length": lambda radius, length: length / 2,
}
GROWS = (  # and after a good one; by the last rule inside the rim as well
    (1.5, lambda radius, length: 1.5 * radius if length > RIM * radius else radius),
    (3, lambda radius, length: 3 * radius if length > RIM * radius else radius),
    (3, lambda radius, length: max(radius, 3 * length)),
)
TOLD_BEFORE = {("a quarter of what it was", None), ("half of the step's length", None), (None, None)}


def other_radii():
    """(id, words, rule) for the ways to change the radius that other books have, one or both other than here."""
    shrinks, grows = ((None, None), *SHRINKS.items()), ((None, None), *GROWS)
    for (k, (small, shrunk)), (m, (large, grown)) in itertools.product(enumerate(shrinks), enumerate(grows)):
        if (small, large) in TOLD_BEFORE:
            continue
        told = (
            [f"After a poor step your radius becomes {small}: it is a quarter of the step's length."] if small else []
        )
        whose = "it" if small else "your radius"
        told += [f"After a good step to the rim {whose} becomes {large} times as large: it doubles."] if large else []
        yield f"{k}{m}", " ".join(told), functools.partial(_otherwise, shrunk, grown)


def _otherwise(shrunk, grown, radius, length, rho):
    """The rule, but for poor steps, good ones, or both."""
    if rho < POOR and shrunk:
        return shrunk(radius, length)
    return grown(radius, length) if rho > GOOD and grown else rule(radius, length, rho)


def run_with(rng, wanted, first=None, unlike=None):
    """A run in which what is wanted of its steps happens, far from every limit of the rule.

    `wanted(rho, inside)` sees all steps of a run; `first` is a gain ratio that its first step shall have; `unlike` changes
    of the loop with which it is not to end where it does.
    """
    while True:
        residual, jacobian, x = _problem(rng)
        radius = (
            float(rng.uniform(0.3, 3.0)) if first is None else _radius_for(rng.uniform(*first), residual, jacobian, x)
        )
        seen = []
        descend(residual, jacobian, x, radius, 9, seen=seen)
        rho, length, radii = np.array(seen).T
        clear = (np.abs(rho[:, None] - [ACCEPT, POOR, GOOD]).min(1) > 0.01) & (rho < 3) & (length > 1e-3)
        counts = [n for n in range(4, 10) if clear[:n].all() and wanted(rho[:n], length[:n] < RIM * radii[:n])]
        if not counts:
            continue
        run = residual, jacobian, x, radius, int(rng.choice(counts))
        if unlike is None or _apart(descend(*run), descend(*run, **unlike)):
            return run


def _apart(end, other):
    """Whether two runs end at other places, or with another radius."""
    return not (np.allclose(end[0], other[0], rtol=1e-4) and np.isclose(end[1], other[1]))


def _radius_for(rho, residual, jacobian, x):
    """A radius whose first step has about this gain ratio, between one that is too short and one that is too long."""
    low, high, seen = 0.05, 20.0, []
    for _ in range(7):
        middle = np.sqrt(low * high)
        descend(residual, jacobian, x, middle, 1, seen=seen)
        low, high = (middle, high) if seen[-1][0] > rho else (low, middle)
    return float(np.sqrt(low * high))


def poor_inside(rho, inside):
    """A step taken back, then more; a poor one inside the rim; one doubled."""
    return (rho[:-1] < 0).any() and ((rho < POOR) & inside).any() and ((rho > GOOD) & ~inside).any()


def barely(rho, inside):
    """A step that lowers the cost and is taken back all the same; of twice its gain ratio it would be taken."""
    return ((rho > ACCEPT / 2) & (rho < ACCEPT))[:-1].any()


def halfway(rho, inside):
    """A step that is taken although the radius shrinks after it."""
    return ((rho > ACCEPT) & (rho < POOR))[:-1].any()


def fairly(rho, inside):
    """A good step to the rim, though not an excellent one, as the last that counts."""
    return ((rho > GOOD) & (rho < 0.88) & ~inside).any()


def well_inside(rho, inside):
    """A good step that ended inside, as the last."""
    return rho[-1] > GOOD and inside[-1]


def just_fair(rho, inside):
    """A step to the rim, first of all, that is a little too poor for the radius to double."""
    return rho[0] > 0.7 and rho[0] < GOOD and not inside[0]


def just_not_poor(rho, inside):
    """A step, first of all, that is a little too good for the radius to shrink."""
    return rho[0] > POOR and rho[0] < 0.3


def just_above_a_tenth(rho, inside):
    """A step, first of all, that is taken, and hardly."""
    return rho[0] > ACCEPT and rho[0] < 0.13


def just_poor(rho, inside):
    """A step, first of all, that is a little too poor for the radius to stay."""
    return rho[0] > 0.205 and rho[0] < POOR


def just_good(rho, inside):
    """A step to the rim, first of all, that is just good enough for the radius to double."""
    return rho[0] > GOOD and rho[0] < 0.795 and not inside[0]


def better_than_promised(rho, inside):
    """A step to the rim, first of all, that brings much more than the model promised."""
    return rho[0] > 1.6 and not inside[0]


def taken_back_at_once(rng):
    """One round, whose step is taken back."""
    while True:
        *problem, radius = *_problem(rng), float(rng.uniform(1, 4))
        seen = []
        descend(*problem, radius, 1, seen=seen)
        if -3 < seen[0][0] < -0.05:
            return *problem, radius, 1


def sized_run(rng, size):
    """A run in which much happens, of a problem so many times as large as another."""
    residual, jacobian, x, radius, steps = run_with(rng, poor_inside)
    return (lambda y: residual(y / size)), (lambda y: jacobian(y / size) / size), size * x, size * radius, steps


def _straight_problem(rng):
    """Straight residuals and their Jacobian, of which every step keeps what it promises, a start, and how far off that is."""
    n = int(rng.integers(2, 5))
    J, b = np.linalg.qr(rng.normal(size=(n + 2, n)))[0] * rng.uniform(1, 3, n), rng.normal(size=n + 2)
    x = rng.uniform(4, 8, n)
    far = float(np.linalg.norm(np.linalg.lstsq(J, J @ x - b, rcond=None)[0]))
    return (lambda x: J @ x - b), (lambda x: J.copy()), x, far


def just_inside(rng, share):
    """One round, which ends at the minimum, a little within the rim: at such a share of the radius."""
    *problem, far = _straight_problem(rng)
    return *problem, far / float(rng.uniform(*share)), 1


def from_a_tiny_radius(rng):
    """Many rounds that all end at the rim, which rounding leaves a hair longer or shorter than the radius."""
    while True:
        *problem, far = _straight_problem(rng)
        run, seen = (*problem, 1e-8 * far, 23), []
        descend(*run, seen=seen)
        if sum(length < radius for _, length, radius in seen) > 2:
            return run


def residuals_that_are_x(rng):
    """Two rounds toward 0, of residuals that are x itself: the very array that is handed in."""
    x = rng.uniform(4, 8, int(rng.integers(2, 5)))
    return (lambda x: x), (lambda x: np.eye(len(x))), x, float(rng.uniform(0.2, 0.3) * np.linalg.norm(x)), 2


RUNS = (
    functools.partial(run_with, wanted=poor_inside),
    functools.partial(run_with, wanted=barely, first=(0.06, 0.085)),
    functools.partial(run_with, wanted=halfway, first=(0.13, 0.22), unlike={"follow": shrunk_where_taken_back}),
    functools.partial(run_with, wanted=fairly, first=(0.78, 0.86)),
    functools.partial(run_with, wanted=well_inside),
)


def _limit(wanted, first, **unlike):
    """A draw of a run whose first step lies beside a limit, and tells it from another one."""
    return functools.partial(run_with, wanted=wanted, first=first, unlike=unlike)


AT_THE_LIMITS = (
    (
        _limit(better_than_promised, (1.7, 2.6), follow=no_praise_for_luck),
        "right, but not where a step to the rim brings far more than was promised. A ρ above 1 is above ¾:",
    ),
    (taken_back_at_once, "right, but not for one round, whose step is taken back:"),
    (
        _limit(just_fair, (0.705, 0.735), follow=functools.partial(rule, good=0.7)),
        "right, but not where a step to the rim has a ρ just below ¾:",
    ),
    (
        _limit(just_good, (0.762, 0.785), follow=functools.partial(rule, good=0.8)),
        "right, but not where a step to the rim has a ρ just above ¾:",
    ),
    (
        _limit(just_not_poor, (0.265, 0.29), follow=functools.partial(rule, poor=0.3)),
        "right, but not where a step has a ρ just above ¼:",
    ),
    (
        _limit(just_poor, (0.21, 0.238), follow=functools.partial(rule, poor=0.2)),
        "right, but not where a step has a ρ just below ¼:",
    ),
    (
        _limit(just_above_a_tenth, (0.112, 0.128), keep=lambda rho: rho > 0.13),
        "right, but not where a step has a ρ just above 0.1:",
    ),
    (
        functools.partial(just_inside, share=(0.9965, 0.9985)),
        "right, but not where a good step ends just inside the rim, at 0.9965 to 0.9985 of the radius:",
    ),
    (
        functools.partial(just_inside, share=(0.9992, 0.9998)),
        "right, but not where a good step ends at 0.9992 to 0.9998 of the radius, which counts as at the rim:",
    ),
    (from_a_tiny_radius, "right, but not for a tiny radius, where each step ends at the rim but for rounding:"),
)


OF_ANOTHER_SIZE = (
    (functools.partial(sized_run, size=1e-6), "right, but not where x and the radius are some 1e-6:"),
    (functools.partial(sized_run, size=1e8), "right, but not where x and the radius are in the hundred millions:"),
)


def no_rounds(rng):
    """No rounds at all: everything stays as it was."""
    return *_problem(rng), float(rng.uniform(0.3, 3.0)), 0


# --- the choice of a way to calibrate ---


def tipping_weight(first="sphere", second="cube", criteria=(3,)):
    """The weight of some criteria of table 4-1, all others counting 1, at which two ways draw level."""
    points = {name: thesis.table_4_1()[name]["points"] for name in (first, second)}
    gap = points[first] - points[second]
    weighted = np.isin(np.arange(len(gap)), criteria)
    return float(-gap[~weighted].sum() / gap[weighted].sum())
