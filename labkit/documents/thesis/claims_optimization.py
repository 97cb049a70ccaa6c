"""Thesis, sections 2.5, 6.2 and 7.1.1 and listings C7, C8: the two wells, their Hessian, table 7-1 and what it claims.

The thesis names neither the residuals of its Gauss-Newton on a scalar function nor, for the MATLAB toolbox, more than
listing C6. What depends on them is compared with stated stand-ins: this library's methods, and SciPy's BFGS with
differenced gradients. The latter because MATLAB's documentation of `fminunc` says that "trust-region" without a
gradient supplied runs as quasi-Newton, and listing C6 leaves the derivatives to the solver.
"""

import itertools
import re
from decimal import Decimal
from functools import cache, partial

import numpy as np

from ...estimation import convexity
from ...estimation import optimization as opt
from ...estimation.differences import numeric_jacobian
from .. import rounding
from ..ledger import Computed, computes
from ..slips import HERE, explained_by
from . import printed as thesis
from . import wells
from .wells import luck, stand_ins

NOTEBOOK = "04_optimization"

DIFFERENCES = 1e-5  # what central differences leave of a right derivative here; a wrong one is off by thousands

MINIMA = {"local": 0, "global": 1}
SQUARE = np.stack(np.meshgrid(*2 * [np.linspace(-6, 6, 121)]), axis=-1)  # starts for the share of each method
DIAGONAL = np.repeat(np.arange(1.0, 100.1, 0.5)[:, None], 2, axis=1)  # the thesis's line of starts, x1 = x2


def _minima():
    return np.array([wells.extrema()[i].x for i in (0, 1)])


@cache
def _share(method):
    """Share of the starts in the square [-6, 6]^2 that end in local minimum, global minimum, saddle, nowhere."""
    label, _ = wells.destinations(method, SQUARE)
    return np.bincount(label.ravel(), minlength=4) / label.size


def _off_line(x):
    """Distance of x from the line through both centers."""
    way, offset = wells.CENTERS[1] - wells.CENTERS[0], x - wells.CENTERS[0]
    return abs(way[0] * offset[1] - way[1] * offset[0]) / np.linalg.norm(way)


# --- Section 6.2: the function, its derivatives, its stationary points ---


@cache
def _saddle_slips():
    """Which single slip in the printed saddle or in (6-16) makes the saddle stationary with the printed value."""
    f, *x = (f"{value:.3f}" for value in thesis.extrema()["saddle"])
    printed = {(HERE, "f"): f, (HERE, "x1"): x[0], (HERE, "x2"): x[1]}
    printed |= {"100": "100", "a1": "1", "a2": "1", "200": "200", "b1": "-1", "b2": "-2"}

    def slope_and_value(place, centers, depth):
        offset = place - centers
        q = (offset**2).sum(1) + 1
        return np.array([*((2 * depth / q**2)[:, None] * offset).sum(0), -(depth / q).sum()])

    def holds(d):
        place, f = rounding.read([d[HERE, "x1"], d[HERE, "x2"]]), rounding.read(d[HERE, "f"])
        centers = [[float(d["a1"]), float(d["a2"])], [float(d["b1"]), float(d["b2"])]]
        found, bound = rounding.propagate(slope_and_value, place, centers, [float(d["100"]), float(d["200"])])
        return bool((np.abs(found - [0.0, 0.0, f.values]) <= bound + [0.0, 0.0, f.halves]).all())

    return {HERE if isinstance(name, tuple) else name: tried for name, tried in explained_by(printed, holds).items()}


def _saddle_proof():
    saddle, printed = wells.extrema()[2], thesis.extrema()["saddle"][1:]
    return (
        f"At the printed saddle (0.105, -0.205) f is {wells.value(printed):.3f}, as printed, but the gradient has "
        f"length {np.linalg.norm(wells.gradient(printed)):.2f}, and the point is {_off_line(printed):.3f} off the "
        f"line through both centers, which holds every stationary point; it vanishes at ({saddle.x[0]:.4f}, "
        f"{saddle.x[1]:.4f}), f = {saddle.value:.3f}, with Hessian eigenvalues {saddle.eigenvalues[0]:.1f} and "
        f"{saddle.eigenvalues[1]:.1f}. No single slip in (6-16) makes the printed point stationary."
    )


@computes("optimization.extrema")
def extrema():
    local, lowest, saddle = wells.extrema()
    value = np.array([[e.value, *e.x] for e in (saddle, local, lowest)])
    return Computed(
        value,
        slips=_saddle_slips(),
        proof=_saddle_proof() + f" The global minimum is {lowest.value:.4f}.",
    )


@computes("optimization.stationary_points")
def stationary_points():
    """Both terms pull toward their centers, so the gradient vanishes only on the segment between them: count sign
    changes there."""
    t = np.linspace(0, 1, 10001)[:, None]
    way = wells.CENTERS[1] - wells.CENTERS[0]
    slope = wells.gradient(wells.CENTERS[0] + t * way) @ way
    return Computed(int((np.sign(slope[1:]) != np.sign(slope[:-1])).sum()))


@computes("optimization.saddle_is_lower")
def saddle_is_lower():
    saddle, rim = wells.extrema()[2], 10 * np.array([[np.cos(t), np.sin(t)] for t in np.linspace(0, 2 * np.pi, 360)])
    return Computed("niedriger" if saddle.value < wells.value(rim).min() else "nicht niedriger")


GRADIENT = (  # (6-17) as printed, q1 and q2 being the two denominators of (6-16)
    "200 (x1-1)/q1^2 + 400 (x1+1)/q2^2",
    "200 (x2-1)/q1^2 + 400 (x2+2)/q2^2",
)


def _evaluated(text, x):
    """A printed expression in x1, x2, q1, q2 at points (n, 2)."""
    code = re.sub(r"(?<=[\d)])\s*(?=[(])", "*", text.replace("^", "**"))
    (x1, x2), q = x.T, wells._parts(x)[1].T
    return eval(code, {"__builtins__": {}}, {"x1": x1, "x2": x2, "q1": q[0], "q2": q[1]})


def _grid():
    return SQUARE[::10, ::10].reshape(-1, 2)


def _gradient_row(component):
    numeric = np.array([numeric_jacobian(wells.value, p)[component] for p in _grid()])
    error = np.abs(_evaluated(GRADIENT[component], _grid()) - numeric).max()
    return Computed(
        GRADIENT[component] if error < DIFFERENCES else f"off by {error:.2g}",
        proof=f"Evaluated at 169 points it differs from central differences of (6-16) by at most {error:.0e}.",
    )


computes("optimization.gradient_1")(partial(_gradient_row, 0))
computes("optimization.gradient_2")(partial(_gradient_row, 1))


@cache
def _hessian_errors():
    """Largest deviation from central differences of the gradient over a grid: of the Hessian of listing C7 and of
    `wells.hessian`, which is the code of listing C9."""
    numeric = np.array([numeric_jacobian(wells.gradient, p) for p in _grid()])
    return {
        "C7": np.abs(wells.printed_hessian(_grid()) - numeric).max(0),
        "C9": np.abs(wells.hessian(_grid()) - numeric).max(0),
    }


def _entry(i, j, printed, right):
    """An entry of listing C7 against C9: which of the two, put in both places, is the derivative of (6-17)?"""
    error = {name: of[i, j] for name, of in _hessian_errors().items()}
    found = explained_by(
        {HERE: "C7", "listing C9": "C9"},
        lambda d: d[HERE] == d["listing C9"] and error[d[HERE]] < DIFFERENCES,
        lambda text: ("C9",) if text == "C7" else ("C7",),
    )
    return Computed(
        printed if error["C7"] < DIFFERENCES else right,
        slips=found,
        proof=f"Against central differences of (6-17) on 169 points the printed entry is off by up to "
        f"{error['C7']:.2g}, the one in the code of listing C9 by {error['C9']:.1e}.",
    )


@computes("optimization.H11")
def h11():
    return _entry(0, 0, "-(-1600 (x1-1)^2)/q2^3", "-1600 (x1+1)^2/q2^3")


@computes("optimization.H12", "optimization.H21")
def h12():
    return _entry(0, 1, "-800 (x1-1)(x2-1)/q1^3 - 1600 (x1+1)(x2+2)/q2^3", "another expression")


@computes("optimization.H22_first")
def h22_first():
    return _entry(1, 1, "-800 (x1-1)^2/q1^3", "-800 (x2-1)^2/q1^3")


@computes("optimization.H22_last")
def h22_last():
    return _entry(1, 1, "-(-1600 (x1-1)^2)/q2^3", "-1600 (x2+2)^2/q2^3")


# --- Section 2.5 and the schemes of 6.1.5, 6.2: formulas tried on numbers ---


@computes("optimization.newton_rule")
def newton_rule():
    """The loop's condition, tried at both minima with the tolerance of listing C8 on f and on its gradient."""
    size = {
        "‖f(x^k)‖ > ε & < i_max": min(abs(e.value) for e in wells.extrema()[:2]),
        "‖∇f(x^k)‖ > ε & < i_max": max(float(np.linalg.norm(wells.gradient(e.x))) for e in wells.extrema()[:2]),
    }
    gradient = "‖∇f(x^k)‖ > ε & < i_max"
    printed = {HERE: "‖f(x^k)‖ > ε & < i_max", "listing C8": gradient}
    found = explained_by(
        printed,
        lambda d: d[HERE] == d["listing C8"] and size[d[HERE]] < 1e-10,  # the tolerance of listing C8
        lambda t: [n for n in size if n != t],
    )
    return Computed(
        found[HERE][0],
        slips=found,
        proof=f"|f| is {size[printed[HERE]]:.1f} or more in both minima, so the printed loop runs on to i_max; "
        f"the gradient is {size[gradient]:.0e} there, and listing C8 tests the gradient.",
    )


def _newton_step(system, x):
    """The step d that a printed system gives at x."""
    g, H = wells.gradient(x), wells.hessian(x)
    return {
        "H^-1 d = -grad f": H @ -g,
        "H^-1 d = grad f": H @ g,
        "H d = -grad f": np.linalg.solve(H, -g),
        "H d = grad f": np.linalg.solve(H, g),
        "d = H^-1 grad f": np.linalg.solve(H, g),
        "d = -H^-1 grad f": -np.linalg.solve(H, g),
    }[system]


@cache
def _newton_equations():
    """Which of (2-25), (2-26) and (2-27) keeps all three from meaning the step of (2-24), x - H^-1 grad f."""
    x = np.array([-0.9, -1.9])
    right = x - np.linalg.solve(wells.hessian(x), wells.gradient(x))

    def holds(d):
        sign = 1.0 if d["(2-27)"] == "x + d" else -1.0
        return all(np.allclose(x + sign * _newton_step(d[name], x), right) for name in ("(2-25)", "(2-26)"))

    printed = {"(2-25)": "d = H^-1 grad f", "(2-26)": "H^-1 d = -grad f", "(2-27)": "x - d"}
    others = {
        "(2-25)": ("d = -H^-1 grad f",),
        "(2-26)": ("H^-1 d = grad f", "H d = -grad f", "H d = grad f"),
        "(2-27)": ("x + d",),
    }
    far = np.linalg.norm(x - _newton_step(printed["(2-26)"], x) - _minima()[1])
    return printed, explained_by(printed, holds, others), far


@computes("optimization.eq_2_26")
def newton_system():
    printed, found, far = _newton_equations()
    return Computed(
        found["(2-26)"][0],
        slips={HERE if name == "(2-26)" else name for name in found},
        proof="(2-24), (2-25) and (2-27) agree on x - d with d = H^-1 grad f. From (-0.9, -1.9), taken "
        f"literally, (2-26) ends {far:.0f} away from the minimum; its inverse and its minus sign both have to go, "
        "and no change of (2-25) or (2-27) makes the three agree.",
    )


@computes("optimization.eq_2_27")
def newton_update():
    printed, found, _ = _newton_equations()
    return Computed(
        found.get("(2-27)", [printed["(2-27)"]])[0],
        proof="It subtracts the d of (2-25), which is the step of (2-24): right as printed.",
    )


@computes("optimization.eq_2_29")
def linearized_sum():
    """The printed sum of linear terms has no minimum: twice the step, twice the decrease."""
    x = np.array([0.5, 0.5])
    r, J = wells.residual(x), wells.jacobian(x)
    fall = {
        "sum without squares": [(r + J @ (-t * J.sum(0))).sum() for t in (1.0, 1e6)],
        "sum of squares": [((r + J @ (-t * J.sum(0))) ** 2).sum() for t in (1.0, 1e6)],
    }
    printed = {HERE: "sum without squares", "(2-28), (2-30)": "sum of squares"}
    found = explained_by(
        printed,
        lambda d: d[HERE] == d["(2-28), (2-30)"] and fall[d[HERE]][1] > 0,
        lambda text: [name for name in fall if name != text],
    )
    return Computed(
        found[HERE][0],
        slips=found,
        proof=f"Without the square of (2-28) the sum of linear terms falls without end: {r.sum():.1f} at (0.5, 0.5), "
        f"{fall[printed[HERE]][1]:.1e} a million gradients on.",
    )


@computes("optimization.eq_2_32")
def gauss_newton_equation():
    """Which factor makes (2-32) the solution (2-31) of the linear problem (2-30)."""
    x = np.array([0.5, 0.5])
    r, J = wells.residual(x), wells.jacobian(x)
    right = np.linalg.lstsq(J, J @ x - r, rcond=None)[0]

    def holds(d):
        factor = J.T if d[HERE] == "J' F" else J
        if factor.shape[1] != len(r):
            return False
        return np.allclose(x - np.linalg.solve(J.T @ J, factor @ r), right) and d["(2-31)"] == "A' b"

    printed = {HERE: "J F", "(2-31)": "A' b"}
    found = explained_by(printed, holds, {HERE: ("J' F",), "(2-31)": ("A b",)})
    return Computed(
        found[HERE][0],
        slips=found,
        proof=f"J has shape {J.shape} and F {r.shape}: the printed product J F does not exist. With the "
        "transpose (2-32) is the solution (2-31), and listing C5 has it.",
    )


@computes("optimization.eq_2_37")
def trust_region_update():
    """Which sign makes the next point the one that (2-36) has judged, for a step that descends as (2-39) does."""
    x = np.array([0.5, 0.5])
    h = opt.dogleg_step(wells.gradient(x), wells.hessian(x), 0.2)
    ends = {"x + h": wells.value(x + h), "x - h": wells.value(x - h)}
    printed = {HERE: "x - h", "(2-36)": "x + h"}
    found = explained_by(
        printed,
        lambda d: d[HERE] == d["(2-36)"] and ends[d[HERE]] < wells.value(x),
        lambda text: [name for name in ends if name != text],
    )
    return Computed(
        found[HERE][0],
        slips=found,
        proof=f"From (0.5, 0.5) with radius 0.2, f goes from {wells.value(x):.1f} to {ends['x + h']:.1f} at x + "
        f"h, as (2-36) takes it, but to {ends['x - h']:.1f} at x - h.",
    )


# --- Table 7-1: results and deviations ---


@computes("optimization.ideal")
def ideal():
    return Computed(np.vstack([_minima(), wells.extrema()[2].x]), slips=_saddle_slips(), proof=_saddle_proof())


@computes("optimization.x_newton", "optimization.x_gauss_newton", "optimization.x_trust_region")
def results():
    minima = _minima()
    return Computed(minima, proof=f"The minimum lies at ({minima[1, 0]:.6f}, {minima[1, 1]:.6f}).")


def _deviation(method):
    printed = thesis.table_7_1(method)
    return Computed(np.abs(printed["x"] - printed["ideal"]))


@computes("optimization.mu_newton")
def mu_newton():
    return _deviation("newton")


@computes("optimization.mu_gauss_newton")
def mu_gauss_newton():
    return _deviation("gauss_newton")


@computes("optimization.mu_trust_region")
def mu_trust_region():
    return _deviation("trust_region")


@computes("optimization.mu_identical")
def mu_identical():
    """Whether the three methods' deviations agree within the digits of the ideal point they are measured from."""
    mu = np.array([thesis.table_7_1(method)["mu"] for method in ("newton", "gauss_newton", "trust_region")])
    run = wells.run("newton", thesis.table_7_1("newton")["start"][0], stop=opt.small_gradient_before())
    true = np.abs(run.solution - _minima()[0]).max()
    return Computed(
        "nahezu identisch" if np.ptp(mu, axis=0).max() < rounding.half_unit("0.98") else "verschieden",
        proof=f"By the table itself they differ by up to {np.ptp(mu, axis=0).max():.0e}. They say nothing about "
        "the methods: mu is the printed point less an ideal point of two decimals; with the rule of listing C8 "
        f"Newton's iterate is within {max(true, 1e-12):.0e} of the minimum, mu says {mu[0, 0].max():.1e}.",
    )


# --- Table 7-1: starts and iterations ---


@computes("optimization.start_newton")
def farthest_newton():
    """Start pushed along the thesis's diagonals in steps of 0.25 from the wells' centers until Newton misses;
    nothing beyond comes back."""
    found = []
    for center, way, target in ((wells.CENTERS[0], 1.0, 0), (wells.CENTERS[1], -1.0, 1)):
        offsets = np.arange(0, 50, 0.25)
        label, _ = wells.destinations("newton", center + way * offsets[:, None])
        found.append(center + way * offsets[label == target].max())
    return Computed(np.array(found))


@computes("optimization.iterations_newton")
def iterations_newton():
    runs = [
        wells.run("newton", start, stop=opt.small_gradient_before()) for start in thesis.table_7_1("newton")["start"]
    ]
    return Computed(np.array([run.iterations for run in runs]))


@computes("optimization.iterations_gauss_newton")
def iterations_gauss_newton():
    return _iterations("gauss_newton")


@computes("optimization.iterations_trust_region")
def iterations_trust_region():
    return _iterations("trust_region")


@cache
def _stand_ins_that_arrive():
    """Stand-ins that reach the claimed minimum from the printed starts of both methods."""
    arrived = None
    for method in ("gauss_newton", "trust_region"):
        for name, start in zip(MINIMA, thesis.table_7_1(method)["start"]):
            here = {key for key, (end, _) in stand_ins(start).items() if end == MINIMA[name]}
            arrived = here if arrived is None else arrived & here
    return sorted(arrived)


@cache
def _iterations(method):
    """BFGS's count from the printed starts; the bound is how far the other stand-ins that reach the same minimum
    differ from it."""
    value, bound, words = [], [], []
    for name, start in zip(MINIMA, thesis.table_7_1(method)["start"]):
        ends = stand_ins(start)
        counts = [n for end, n in ends.values() if end == MINIMA[name]]
        value.append(ends["BFGS"][1])
        bound.append(max(abs(n - ends["BFGS"][1]) for n in counts))
        listed = ", ".join(f"{key} {'LGS-'[end]} {n}" for key, (end, n) in ends.items())
        words.append(f"from ({start[0]:g}, {start[1]:g}): {listed}")
    return Computed(
        np.array(value),
        bound=np.array(bound),
        simulated=True,
        proof="Neither the residuals nor the toolbox's settings are published. Stand-ins, with end (L local, G "
        "global, - nowhere) and count, "
        + "; ".join(words)
        + ". From all four printed starts the claimed minimum is reached by "
        f"{', '.join(_stand_ins_that_arrive()) or 'none'} alone. Four landings are weak evidence: by tosses of "
        f"a coin at least one of five has them right with probability {luck():.2f}.",
    )


@cache
def _reach():
    """Farthest start on the diagonal up to (100, 100), in steps of 0.5, from which each method reaches local and
    global minimum."""
    table = {}
    for method in wells.METHODS[1:]:
        label, _ = wells.destinations(method, DIAGONAL)
        table[method] = [max(DIAGONAL[label == target, 0], default=np.nan) for target in (0, 1)]
    return table


@computes("optimization.start_gauss_newton")
def farthest_gauss_newton():
    reach = _reach()
    value = np.repeat(np.array(reach["gauss_newton"])[:, None], 2, axis=1)
    spread = np.repeat((np.array(reach["levenberg_marquardt"]) - reach["gauss_newton"])[:, None], 2, axis=1)
    return Computed(
        value,
        bound=spread,
        simulated=True,
        proof=f"With the residuals that chapter 4 takes, full steps fail from (4.3, 4.3) and reach the minima from at "
        f"most {reach['gauss_newton'][0]:g} and {reach['gauss_newton'][1]:g} on the diagonal; damped "
        f"(Levenberg-Marquardt) they reach them up to {reach['levenberg_marquardt'][0]:g} and "
        f"{reach['levenberg_marquardt'][1]:g}; the search ends at 100. Residuals and damping of the thesis are not "
        "published.",
    )


@computes("optimization.start_trust_region")
def farthest_trust_region():
    reach = _reach()["trust_region"]
    label, _ = wells.destinations("trust_region", DIAGONAL)
    changes = int((np.diff(label) != 0).sum())
    return Computed(
        np.repeat(np.array(reach)[:, None], 2, axis=1),
        simulated=True,
        proof="Solver and settings are MATLAB's. The trust region of chapter 4 ends in a minimum from "
        f"{(label < 2).sum()} of {label.size} starts on the diagonal up to (100, 100), where the search ends, and "
        f"changes from one to the other {changes} times: with it there is no farthest start.",
    )


@computes("optimization.start_spacing")
def start_spacing():
    starts = np.concatenate(
        [thesis.table_7_1(method)["start"] for method in wells.METHODS if method != "levenberg_marquardt"]
    )
    decimals = sorted({abs(Decimal(repr(float(x)))) for x in starts.ravel()})  # as printed: no digit is lost
    odd = {b - a: (a, b) for a, b in itertools.pairwise(decimals) if (b - a) % Decimal("0.5")}
    step = min(odd, default=Decimal("0.5"))
    apart = f"; {odd[step][0]} and {odd[step][1]} differ by {step}" if odd else ""
    return Computed(float(step), proof=f"Starts on one line in steps of 0.5 differ by multiples of 0.5{apart}.")


@computes("optimization.fewer_iterations")
def fewer_iterations():
    counts = {"Trust-Region": "trust_region", "Gauß-Newton": "gauss_newton", "Newton": "newton"}
    total = {name: int(thesis.table_7_1(key)["iterations"].sum()) for name, key in counts.items()}
    return Computed(min(total, key=total.get), proof=f"By the table itself, both minima together: {total}.")


@computes("optimization.farthest_start")
def farthest_start():
    starts = {"Newton": "newton", "Gauß-Newton": "gauss_newton", "Trust-Region": "trust_region"}
    tables = {name: thesis.table_7_1(key) for name, key in starts.items()}
    far = {name: float(np.linalg.norm(t["start"] - t["ideal"], axis=1).max()) for name, t in tables.items()}
    listed = ", ".join(f"{name} {way:.1f}" for name, way in far.items())
    return Computed(max(far, key=far.get), proof=f"By the table itself, farthest start from its minimum: {listed}.")


@computes("optimization.saddle_newton")
def saddle_newton():
    share = _share("newton")
    thesis_line, _ = wells.destinations("newton", [[1.3, 1.3]])
    steps = wells.run("newton", [0.0, 0.0]).iterations
    return Computed(
        "gefunden" if share[2] > 0 else "Keine Lösung",
        proof=f"Newton ends in the saddle from {100 * share[2]:.1f} % of the starts in [-6, 6]^2 and in a minimum "
        f"from only {100 * (share[0] + share[1]):.1f} %; from (0, 0) in {steps} steps, and from (1.3, 1.3), 0.05 "
        f"beyond the thesis's own start, it ends in the {wells.NAMES[thesis_line[0]]}.",
    )


def _saddle_of(method):
    share = _share(method)
    return Computed(
        "Keine Lösung" if share[2] == 0 else "gefunden",
        simulated=True,
        proof="A stand-in for the thesis's method, whose residuals or settings are not published, ends in the "
        f"saddle from {100 * share[2]:.1f} % of the starts in [-6, 6]^2.",
    )


computes("optimization.saddle_gauss_newton")(partial(_saddle_of, "gauss_newton"))
computes("optimization.saddle_trust_region")(partial(_saddle_of, "trust_region"))


@computes("optimization.saddle_must_be_hit_exactly")
def saddle_basin():
    """All starts on 20 rings around the saddle, tested for the largest disk that ends in it."""
    saddle = wells.extrema()[2].x
    angle = np.linspace(0, 2 * np.pi, 240, endpoint=False)
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    radii = np.arange(0.02, 1.01, 0.02)
    whole = [(wells.destinations("newton", saddle + radius * ring)[0] == 2).all() for radius in radii]
    safe = max(radii[: whole.index(False)], default=0.0)
    return Computed(
        "exakt" if safe == 0 else "from a whole neighborhood",
        proof=f"Newton converges to the saddle from every start tested within {safe:.2f} of it (240 directions, rings "
        "of 0.02).",
    )


@computes("optimization.newton_confuses")
def newton_confuses():
    ends = {wells.NAMES[k] for k in range(3) if _share("newton")[k] > 0}
    return Computed(
        "nicht unterscheiden" if {"saddle", "local minimum"} <= ends else "unterscheiden",
        proof=f"From the square [-6, 6]^2 Newton ends in: {', '.join(sorted(ends))}.",
    )


def _rating(method):
    """The thesis's three words in the order of the share of starts that reach a minimum."""
    shares = {name: _share(name)[:2].sum() for name in ("newton", "gauss_newton", "trust_region")}
    order = sorted(shares, key=shares.get)
    return Computed(
        ("Schlecht", "Gut", "Sehr gut")[order.index(method)],
        simulated=True,
        proof="Ranked by the share of starts in [-6, 6]^2 that end in a minimum, with stand-ins for two of the three: "
        + ", ".join(f"{name} {100 * share:.0f} %" for name, share in shares.items())
        + ".",
    )


@computes("optimization.stability_newton")
def stability_newton():
    return _rating("newton")


@computes("optimization.stability_gauss_newton")
def stability_gauss_newton():
    return _rating("gauss_newton")


@computes("optimization.stability_trust_region")
def stability_trust_region():
    return _rating("trust_region")


@computes("optimization.strict_convexity")
def strict_convexity():
    """Whether a strictly convex function must have a positive definite Hessian everywhere: x^4 is asked, at 0."""
    ends = np.random.default_rng(0).uniform(-2, 2, (200, 2, 1))
    gaps = []
    for x, y in ends:
        _, values, heights = convexity.chord(lambda z: float(z[0] ** 4), x, y, 11)
        gaps.append((heights - values)[1:-1].min() / abs(y - x)[0] ** 4)
    definite = convexity.positive_definite([[12 * 0.0**2]])
    strict = min(gaps) > 0
    return Computed(
        "positiv semidefinit" if strict and not definite else "positiv definit",
        proof=f"All {len(ends)} chords of x^4 lie above it inside, and its second derivative 12 x^2 is 0 at 0. A "
        "positive definite Hessian is sufficient for strict convexity, not necessary.",
    )
