"""Thesis, sections 2.5, 6.2 and 7.1.1 and listings C7, C8: the two wells, their Hessian, table 7-1 and what it claims.

The thesis names neither the residuals of its Gauss-Newton on a scalar function nor, for the MATLAB toolbox, more than
listing C6. What depends on them is compared with stated stand-ins: this library's methods, and SciPy's BFGS with
differenced gradients. The latter because MATLAB's documentation of `fminunc` says that "trust-region" without a
gradient supplied runs as quasi-Newton, and listing C6 leaves the derivatives to the solver.
"""

from functools import cache

import numpy as np

from ...estimation import optimization as opt
from ...estimation.differences import numeric_jacobian
from ..ledger import Computed, computes
from . import printed as thesis
from . import wells
from .wells import luck, stand_ins

NOTEBOOK = "04_optimization"

MINIMA = {"local": 0, "global": 1}
SQUARE = np.stack(np.meshgrid(*2 * [np.linspace(-6, 6, 121)]), axis=-1)  # starts for the share of each method
DIAGONAL = np.repeat(np.arange(1.0, 100.1, 0.5)[:, None], 2, axis=1)  # the thesis's line of starts, x1 = x2


def _minima():
    return np.array([wells.extrema()[i].x for i in (0, 1)])


def _cut(value, decimals):
    """`value` with its digits cut off instead of rounded."""
    return np.trunc(value * 10**decimals) / 10**decimals


@cache
def _share(method):
    """Share of the starts in the square [-6, 6]^2 that end in local minimum, global minimum, saddle, nowhere."""
    label, _ = wells.destinations(method, SQUARE)
    return np.bincount(label.ravel(), minlength=4) / label.size


def _printed_saddle():
    """The printed saddle, the length of the gradient there, and whether that is more than three rounded digits
    explain."""
    saddle = thesis.extrema()["saddle"][1:]
    slope = np.linalg.norm(wells.gradient(saddle))
    return saddle, slope, slope > 0.5e-3 * np.sqrt(2) * np.abs(np.linalg.eigvalsh(wells.hessian(saddle))).max()


def _off_line(x):
    """Distance of x from the line through both centers."""
    way, offset = wells.CENTERS[1] - wells.CENTERS[0], x - wells.CENTERS[0]
    return abs(way[0] * offset[1] - way[1] * offset[0]) / np.linalg.norm(way)


# --- Section 6.2: the function, its derivatives, its stationary points ---


@computes("optimization.extrema")
def extrema():
    local, lowest, saddle = wells.extrema()
    value = np.array([[e.value, *e.x] for e in (saddle, local, lowest)])
    printed, slope, not_stationary = _printed_saddle()
    wrong = np.zeros((3, 3), dtype=bool)
    wrong[0] = not_stationary
    wrong[2, 0] = _cut(lowest.value, 3) == -207.159
    return Computed(
        value,
        misprint=wrong,
        proof=f"At the printed saddle (0.105, -0.205) f is {wells.value(printed):.3f}, as printed, but the gradient "
        f"has length {slope:.2f}, and the point is {_off_line(printed):.3f} off the line through both centers, which "
        f"holds every stationary point; it vanishes at ({saddle.x[0]:.4f}, {saddle.x[1]:.4f}), f = "
        f"{saddle.value:.3f}, with Hessian eigenvalues {saddle.eigenvalues[0]:.1f} and {saddle.eigenvalues[1]:.1f}. "
        f"The global minimum {lowest.value:.4f} cut after three decimals is the printed {_cut(lowest.value, 3):.3f}; "
        f"rounded it is {lowest.value:.3f}.",
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
    return Computed("lower" if saddle.value < wells.value(rim).min() else "not lower")


@computes("optimization.gradient_1", "optimization.gradient_2")
def gradient():
    x = SQUARE[::10, ::10].reshape(-1, 2)
    error = max(np.abs(numeric_jacobian(wells.value, p) - wells.gradient(p)).max() for p in x)
    return Computed("agrees" if error < 1e-6 else f"off by {error:.2g}")


@cache
def _hessian_errors():
    """Largest deviation from central differences of the gradient over a grid: of the printed Hessian and of
    "`wells.hessian`."""
    x = SQUARE[::10, ::10].reshape(-1, 2)
    numeric = np.array([numeric_jacobian(wells.gradient, p) for p in x])
    return np.abs(wells.printed_hessian(x) - numeric).max(0), np.abs(wells.hessian(x) - numeric).max(0)


def _entry(i, j, printed, right):
    wrong, good = _hessian_errors()
    text = printed if wrong[i, j] < 1e-5 else right
    return Computed(
        text,
        misprint=wrong[i, j] > 1e-5 > good[i, j],
        proof=f"Against central differences of (6-17) on 169 points the printed entry is off by up to "
        f"{wrong[i, j]:.0f}, the corrected one (as in the code of listing C9) by {good[i, j]:.1e}.",
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
    smallest = min(abs(e.value) for e in wells.extrema()[:2])
    return Computed(
        "|f(x)| > eps" if smallest < 1e-10 else "|grad f(x)| > eps",
        misprint=smallest > 1e-10,
        proof=f"|f| is {smallest:.1f} or more in both minima, so the printed loop never ends; listing C8 tests the "
        "gradient.",
    )


@computes("optimization.eq_2_26", "optimization.eq_2_27")
def newton_equations():
    """One step from (-0.9, -1.9), close to the global minimum, with each printed combination."""
    x = np.array([-0.9, -1.9])
    g, H = wells.gradient(x), wells.hessian(x)
    ends = {"printed": x - H @ -g, "inverse dropped": x - np.linalg.solve(H, -g), "right": x + np.linalg.solve(H, -g)}
    miss = {name: np.linalg.norm(end - _minima()[1]) for name, end in ends.items()}
    wrong = miss["right"] < min(miss["printed"], miss["inverse dropped"])
    return Computed(
        "H d = -grad f, x + d" if wrong else "as printed",
        misprint=wrong,
        proof=f"From (-0.9, -1.9), {np.linalg.norm(x - _minima()[1]):.2f} from the minimum, the printed pair ends "
        f"{miss['printed']:.0f} away, without the inverse {miss['inverse dropped']:.2f} away, and H d = -grad f with "
        f"x + d {miss['right']:.3f} away.",
    )


@computes("optimization.eq_2_29")
def linearized_sum():
    """The printed sum of linear terms has no minimum: twice the step, twice the decrease."""
    x = np.array([0.5, 0.5])
    r, slope = wells.residual(x).sum(), wells.jacobian(x).sum(0)
    fall = [r - slope @ slope * t for t in (1.0, 1e6)]
    return Computed(
        "sum of squares",
        misprint=fall[1] < fall[0] < r,
        proof=f"Without the square of (2-28) the sum of linear terms falls without end: {r:.1f} at (0.5, 0.5), "
        f"{fall[1]:.1e} a million gradients on.",
    )


@computes("optimization.eq_2_32")
def gauss_newton_equation():
    r, J = wells.residual([0.5, 0.5]), wells.jacobian([0.5, 0.5])
    fits = J.shape[1] == r.shape[0]
    return Computed(
        "J F" if fits else "J' F",
        misprint=not fits,
        proof=f"J has shape {J.shape} and F {r.shape}: the printed product J F does not exist. Listing C5 has the "
        "transpose.",
    )


@computes("optimization.eq_2_37")
def trust_region_update():
    x = np.array([0.5, 0.5])
    h = opt.dogleg_step(wells.gradient(x), wells.hessian(x), 0.2)
    up, down, here = wells.value(x - h), wells.value(x + h), wells.value(x)
    return Computed(
        "x + h" if down < here < up else "x - h",
        misprint=down < here < up,
        proof=f"From (0.5, 0.5) with radius 0.2, f goes from {here:.1f} to {down:.1f} at x + h, as (2-36) takes it, "
        f"but to {up:.1f} at x - h.",
    )


# --- Table 7-1: results and deviations ---


@computes("optimization.ideal")
def ideal():
    saddle, (_, slope, not_stationary) = wells.extrema()[2].x, _printed_saddle()
    return Computed(
        np.vstack([_minima(), saddle]),
        misprint=not_stationary,
        proof=f"The gradient vanishes at ({saddle[0]:.4f}, {saddle[1]:.4f}); at the printed ideal saddle it has length "
        f"{slope:.2f}.",
    )


@computes("optimization.x_newton", "optimization.x_gauss_newton", "optimization.x_trust_region")
def results():
    minima, printed = _minima(), thesis.table_7_1("newton")["x"]
    return Computed(
        minima,
        misprint=np.abs(minima - printed) > 0.5e-4,
        proof=f"{minima[1, 0]:.6f} and {minima[1, 1]:.6f} cut after four decimals are the printed "
        f"{_cut(minima[1, 0], 4):.4f} and {_cut(minima[1, 1], 4):.4f}; rounded they are {minima[1, 0]:.4f} and "
        f"{minima[1, 1]:.4f}.",
    )


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


@computes("optimization.mu_is_accuracy")
def mu_is_accuracy():
    printed = thesis.table_7_1("newton")
    run = wells.run("newton", printed["start"][0], stop=opt.small_gradient_before())
    true = np.abs(run.solution - _minima()[0]).max()
    return Computed(
        "accuracy of the methods" if true > 1e-3 else "rounding of the ideal point",
        proof=f"mu is the printed point less an ideal point of two decimals. With the rule of listing C8 the iterate "
        f"is within {max(true, 1e-16):.0e} of the minimum, mu says {printed['mu'][0].max():.1e}.",
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
        + ". BFGS is the only one that reaches the claimed minimum from all four printed starts. Four landings are "
        f"weak evidence: by tosses of a coin at least one of five has them right with probability {luck():.2f}.",
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
        proof=f"With the residuals of `wells.residual`, full steps fail from (4.3, 4.3) and reach the minima from at "
        f"most {reach['gauss_newton'][0]:g} and {reach['gauss_newton'][1]:g} on the diagonal; damped "
        f"(Levenberg-Marquardt) they reach them up to {reach['levenberg_marquardt'][0]:g} and "
        f"{reach['levenberg_marquardt'][1]:g}, the end of the search. Residuals and damping of the thesis are not "
        "published.",
    )


@computes("optimization.start_trust_region")
def farthest_trust_region():
    reach = _reach()["trust_region"]
    label, _ = wells.destinations("trust_region", DIAGONAL)
    changes = int((np.diff(label) != 0).sum())
    return Computed(
        np.repeat(np.array(reach)[:, None], 2, axis=1),
        proof=f"There is no farthest start: along the diagonal up to (100, 100) the trust region always ends in a "
        f"minimum and changes from one to the other {changes} times; the last local start is {reach[0]:g}, the last "
        f"global one {reach[1]:g}.",
    )


@computes("optimization.start_distance_newton")
def start_distance():
    gaps = thesis.table_7_1("newton")["start"] - _minima()
    far = np.linalg.norm(gaps, axis=1)
    return Computed(
        far.max(),
        proof=f"The printed starts lie {np.abs(gaps).min():.2f} to {np.abs(gaps).max():.2f} from the minima in each "
        f"coordinate, {far[0]:.2f} and {far[1]:.2f} as a distance; 0.25 is their offset from the centers (1, 1) and "
        "(-1, -2) of the two terms.",
    )


@computes("optimization.start_spacing")
def start_spacing():
    starts = np.concatenate(
        [thesis.table_7_1(method)["start"] for method in wells.METHODS if method != "levenberg_marquardt"]
    )
    gaps = np.diff(np.unique(np.abs(starts)))
    odd = gaps[np.abs(gaps / 0.5 - np.round(gaps / 0.5)) > 1e-6]
    return Computed(
        0.5 if not len(odd) else odd.min(),
        proof=f"Starts on one line in steps of 0.5 differ by multiples of 0.5; 4.3 and 4.5 differ by {odd.min():.1f}.",
    )


# --- Table 7-1 and the text around it: what is claimed ---


@computes("optimization.dogleg_accuracy")
def dogleg_accuracy():
    """Error at the end of both kinds of step, from the same 25 starts."""
    error = {}
    for subproblem in (opt.dogleg_step, opt.exact_step):
        runs = [wells.run("trust_region", x, subproblem=subproblem) for x in SQUARE[::30, ::30].reshape(-1, 2)]
        error[subproblem] = max(min(np.linalg.norm(run.solution - m) for m in _minima()) for run in runs)
    same = error[opt.dogleg_step] < 1e-9 > error[opt.exact_step]
    return Computed(
        "very good" if same else "good",
        proof=f"From {len(runs)} starts in [-6, 6]^2 both kinds of step end within {max(*error.values(), 1e-15):.0e} "
        "of a minimum: the subproblem changes the way, not the accuracy of the end.",
    )


@computes("optimization.fewer_iterations")
def fewer_iterations():
    counts = {name: thesis.table_7_1(name)["iterations"] for name in ("trust_region", "gauss_newton")}
    return Computed("trust region" if (counts["trust_region"] < counts["gauss_newton"]).all() else "neither")


@computes("optimization.saddle_newton", "optimization.saddle_by_any")
def saddle_newton():
    share = _share("newton")
    thesis_line, _ = wells.destinations("newton", [[1.3, 1.3]])
    steps = wells.run("newton", [0.0, 0.0]).iterations
    return Computed(
        "found" if share[2] > 0 else "no solution",
        proof=f"Newton ends in the saddle from {100 * share[2]:.1f} % of the starts in [-6, 6]^2 and in a minimum "
        f"from only {100 * (share[0] + share[1]):.1f} %; from (0, 0) in {steps} steps, and from (1.3, 1.3), 0.05 "
        f"beyond the thesis's own start, it ends in the {wells.NAMES[thesis_line[0]]}.",
    )


@computes("optimization.saddle_gauss_newton")
def saddle_gauss_newton():
    return Computed("no solution" if _share("gauss_newton")[2] == 0 else "found")


@computes("optimization.saddle_trust_region")
def saddle_trust_region():
    return Computed("no solution" if _share("trust_region")[2] == 0 else "found")


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
        "exactly" if safe == 0 else "from a whole neighborhood",
        proof=f"Newton converges to the saddle from every start tested within {safe:.2f} of it (240 directions, rings "
        "of 0.02).",
    )


@computes("optimization.newton_confuses")
def newton_confuses():
    return Computed("cannot tell a saddle from a minimum" if _share("newton")[2] > 0 else "tells them apart")


def _rating(method):
    """The thesis's three words in the order of the share of starts that reach a minimum."""
    shares = {name: _share(name)[:2].sum() for name in ("newton", "gauss_newton", "trust_region")}
    order = sorted(shares, key=shares.get)
    return Computed(("bad", "good", "very good")[order.index(method)])


@computes("optimization.stability_newton")
def stability_newton():
    return _rating("newton")


@computes("optimization.stability_gauss_newton")
def stability_gauss_newton():
    return _rating("gauss_newton")


@computes("optimization.stability_trust_region")
def stability_trust_region():
    return _rating("trust_region")
