"""Chapter 3: tip and pivot from poses that touch one point."""

import functools

import numpy as np

from ...calibration import pivot, robust
from ...documents.lab_sheet import printed as lab_sheet
from ...exercises import metrics
from ...exercises.engine import Chapter, Exercise, Prediction
from ...exercises.outcome import Mistake
from ...exercises.special import right_where
from ...exercises.value import Value
from ...geometry import frames
from ...geometry.lie import exp_so3
from . import special


def turns(rng, n, between_deg=(10, 40)):
    """n rotations by such angles about random axes."""
    axis = rng.normal(size=(n, 3))
    axis *= np.deg2rad(rng.uniform(*between_deg, (n, 1))) / np.linalg.norm(axis, axis=1, keepdims=True)
    return exp_so3(axis)


def poses(rng, std_trans=0.0, between_deg=(10, 40), counts=(4, 5, 6, 8, 13)):
    """Four to thirteen poses, or as many as asked for, that touch one point, positions off by noise."""
    tip, point = rng.uniform(-50, 50, 3) - (0, 0, 90), rng.uniform(-300, 300, 3)
    return pivot.touching_poses(turns(rng, rng.choice(counts), between_deg), tip, point, 0.0, std_trans, rng)


FEW = ((1, "right, but not for a single pose:"), (3, "right, but not for three poses:"))


def of_few(metric):
    """Draws of one pose and of three, where rows and coordinates are easily taken for each other."""
    return [(lambda rng, n=n: (poses(rng, counts=(n,)),), metric, words) for n, words in FEW]


def few_poses_and_points(rng, count):
    """Some poses, and any tip and pivot."""
    return poses(rng, counts=(count,)), rng.uniform(-50, 50, 3), rng.uniform(-300, 300, 3)


def system(rng, std_trans=0.0, counts=(4, 5, 6, 8, 13)):
    """Stacked matrix and right-hand side."""
    T = poses(rng, std_trans, counts=counts)
    return pivot.pivot_matrix(T), pivot.pivot_rhs(T)


def narrow_system(rng, between_deg=(10, 25), ratio=(0.075, 0.095)):
    """The same, of a narrow set: its least singular value is a little below a tenth of the largest, or of what is asked
    for, and counts."""
    while True:
        T = poses(rng, between_deg=between_deg)
        A = pivot.pivot_matrix(T)
        s = np.linalg.svd(A, compute_uv=False)
        if ratio[0] < s[5] / s[0] < ratio[1]:
            return A, pivot.pivot_rhs(T)


def poses_and_result(rng):
    """Noisy poses with some tip and pivot, not the best ones: who fits anew, or takes the mean off, is found out."""
    T = poses(rng, 1.0)
    result = pivot.calibrate_pivot(T)
    return T, result.tip + rng.uniform(-20, 20, 3), result.pivot + rng.uniform(-20, 20, 3)


def matrix_and_residuals(rng):
    """Stacked matrix and the residuals, shape (n, 3), of its solution."""
    T = poses(rng, 0.5)
    return pivot.pivot_matrix(T), pivot.calibrate_pivot(T).residuals


def matrix_and_other_residuals(rng):
    """The same with the residuals of a solution that was rounded: they do not add up to 0."""
    A, residuals = matrix_and_residuals(rng)
    return A, residuals + rng.uniform(0.1, 0.3, 3)


def near_first(rng, count):
    """Distances, one of them far below the scale and some beyond the cutoff, and a scale; the nearest leads."""
    scale = rng.choice([rng.uniform(0.1, 0.6), rng.uniform(1.5, 3)])
    near, far = rng.uniform(0.02, 0.13, 1), rng.uniform(1.1, 6, 3) * pivot.TUKEY
    middle = rng.uniform(0.2, 0.95, count - 4) * pivot.TUKEY
    return scale * np.concatenate([near, rng.permutation(np.concatenate([middle, far]))]), scale


def far_first(rng, count):
    """The same, one beyond the cutoff leading: a 0 for it must not make whole numbers of all weights."""
    d, scale = near_first(rng, count)
    return np.sort(d)[::-1].copy(), scale


def all_far(rng):
    """Distances beyond the cutoff, all of them: no weight is left."""
    d, scale = near_first(rng, 5)
    return d + pivot.TUKEY * scale, scale


def one_alone(rng):
    """One distance, within the cutoff."""
    d, scale = near_first(rng, 5)
    return d[:1], scale


def one_at_0(rng):
    """The same, a pose in which the tip is exactly at the point among them."""
    d, scale = near_first(rng, 7)
    return np.concatenate([d, np.zeros(1)]), scale


# Wrong variants --------------------------------------------------------------------------------------------------------


def _blocks(left, right):
    """A variant of pivot_matrix with other blocks."""

    def variant(T_WF):
        return np.vstack([np.hstack([left(T[:3, :3]), right]) for T in T_WF])

    return variant


def _seen_from_the_flange(T_WF):
    back = T_WF[:, :3, :3].swapaxes(1, 2)
    return np.concatenate([np.broadcast_to(np.eye(3), back.shape), -back], axis=2).reshape(-1, 6)


def _side_by_side(T_WF):
    return np.hstack([np.vstack([T[:3, :3], -np.eye(3)]) for T in T_WF])


def _with_pivot_block(block):
    """The columns of the tip, with other ones of the pivot: block(n)."""
    return lambda T_WF: np.hstack([pivot.pivot_matrix(T_WF)[:, :3], block(len(T_WF))])


def _rows_overlap(T_WF):
    """Block i begins in row i, where it should begin in row 3i."""
    A = np.zeros((3 * len(T_WF), 6))
    for i, T in enumerate(T_WF):
        A[i : i + 3] = np.hstack([T[:3, :3], -np.eye(3)])
    return A


def _entries_overlap(T_WF):
    """Position i begins in entry i, where it should begin in entry 3i."""
    b = np.zeros(3 * len(T_WF))
    for i, T in enumerate(T_WF):
        b[i : i + 3] = -T[:3, 3]
    return b


def _tip_alone(A, b):
    """The pivot forgotten: R tip = -p."""
    return np.concatenate([np.linalg.lstsq(A[:, :3], b, rcond=None)[0], np.zeros(3)])


def _one_after_the_other(A, b):
    """The tip fitted as if there were no pivot, then the pivot to what is left."""
    tip = np.linalg.lstsq(A[:, :3], b, rcond=None)[0]
    return np.concatenate([tip, np.linalg.lstsq(A[:, 3:], b - A[:, :3] @ tip, rcond=None)[0]])


def _total_least_squares(A, b):
    """The least changes of A and b together that make the equations hold."""
    v = np.linalg.svd(np.column_stack([A, b]))[2][-1]
    return -v[:6] / v[6]


def _without_the_pivot(differences):
    """The tip from differences of poses, as if each had noise of its own, then the pivot as a mean."""

    def variant(A, b):
        blocks, right = A[:, :3].reshape(-1, 3, 3), b.reshape(-1, 3)
        tip = np.linalg.lstsq(differences(blocks).reshape(-1, 3), differences(right).ravel(), rcond=None)[0]
        return np.concatenate([tip, (blocks @ tip - right).mean(axis=0)])

    return variant


def _variance_of_each_axis(A, residuals):
    """A covariance with another variance for x, y and z: of the rows, or of both sides."""
    n = len(residuals)
    return np.tile((residuals**2).sum(axis=0) / (n - 2), 2)[:, None] * np.linalg.inv(A.T @ A)


def _each_its_own(factor):
    """A covariance of equations that are noisy each in its own way, as the statistics of unequal errors has it."""

    def variant(A, residuals):
        P = np.linalg.pinv(A)
        return factor(len(residuals)) * (P * residuals.ravel() ** 2) @ P.T

    return variant


def _covariance(scale):
    """A variant of pivot_covariance with another variance: scale(r, n)."""

    def variant(A, residuals):
        r = residuals.ravel()
        return scale(r, len(residuals)) * np.linalg.inv(A.T @ A)

    return variant


def _weights(rule):
    """A variant of robust_weights: rule(d / (cutoff scale))."""

    def variant(distances, scale):
        return rule(distances / (pivot.TUKEY * scale))

    return variant


def _tukey_weights(distances, scale):
    return robust.tukey_weights(distances, scale, pivot.TUKEY)


def _kreisel():
    return pivot.calibrate_pivot(lab_sheet.kreisel_poses())


def _squares():
    return (_kreisel().residuals ** 2).sum()


def _correlation(covariance):
    std = np.sqrt(np.diag(covariance))
    return covariance / np.outer(std, std)


CHAPTER = Chapter(
    "03-quirlen",
    title="Quirlen: calibration about a pivot",
    items=[
        Exercise(
            "pivot_matrix",
            reference=pivot.pivot_matrix,
            sizes=("T_WF",),
            draw=lambda rng: (poses(rng),),
            metric=metrics.Numbers(1e-9),
            noisy=of_few(metrics.Numbers(1e-9)),
            properties=(right_where(pivot.pivot_matrix, metrics.Numbers(1e-9), *special.ALONE),),
            hints=(
                "Each pose gives three rows: which numbers multiply the tip, which the pivot?",
                "R_i tip - I pivot = -p_i: three rows [R_i  -I], all poses beneath each other.",
                "`return np.vstack([np.hstack([T[:3, :3], -np.eye(3)]) for T in T_WF])`",
            ),
            mistakes=[
                Mistake(
                    _blocks(lambda R: R, np.eye(3)),
                    "The pivot enters with the wrong sign: R tip + p - pivot = 0, so its block is -I.",
                ),
                Mistake(
                    _blocks(lambda R: R.T, -np.eye(3)),
                    "You took Rᵀ instead of R: the tip is given in the tool frame, and R turns it into the world.",
                ),
                Mistake(
                    _blocks(lambda R: -R, np.eye(3)),
                    "Both blocks have the opposite sign. That solves the same problem with +p on the right, but the sheet's right-hand side is -p.",
                ),
                Mistake(
                    _seen_from_the_flange,
                    "These are the right rows multiplied by Rᵀ, which the right-hand side, -p, is not: R stands before the tip, and -I "
                    "before the pivot.",
                    id="pivot-matrix-from-the-flange",
                ),
                Mistake(
                    lambda T_WF: pivot.pivot_matrix(T_WF)[:, [3, 4, 5, 0, 1, 2]],
                    "The blocks have changed places: the unknowns are (tip, pivot), the tip first.",
                ),
                Mistake(
                    _blocks(lambda R: R, -np.ones((3, 3))),
                    "The block of the pivot is filled with -1. The identity matrix, `np.eye(3)`, has its ones on the diagonal alone.",
                    id="pivot_matrix-8b2b87",
                ),
                Mistake(
                    _side_by_side,
                    "The poses stand side by side here, and -I beneath R. Each pose adds equations, not unknowns: R and -I belong side by side, and the rows of the poses beneath each other.",
                    id="pivot_matrix-49c597",
                ),
                Mistake(
                    lambda T_WF: pivot.pivot_matrix(T_WF).reshape(-1, 3, 6).swapaxes(0, 1).reshape(-1, 6),
                    "Your rows are sorted by axis, all of x first. The three rows of a pose stand together, pose after pose.",
                    id="pivot-matrix-by-axis",
                ),
                Mistake(
                    lambda T_WF: np.hstack([T_WF[:, :3, :3].reshape(3, -1).T, pivot.pivot_matrix(T_WF)[:, 3:]]),
                    "The entries of the rotations stand in wrong places: `reshape` reads row after row, pose after pose, so "
                    "`T_WF[:, :3, :3].reshape(-1, 3)` stacks them as they are.",
                    id="pivot-matrix-reshaped",
                ),
                Mistake(
                    _rows_overlap,
                    "The blocks overwrite each other: each pose takes three rows, so block i begins in row 3 * i.",
                ),
                Mistake(
                    lambda T_WF: pivot.pivot_matrix(T_WF)[:, :3],
                    "The columns of the pivot are missing. Its place is unknown too.",
                ),
                Mistake(
                    _blocks(lambda R: R.T, np.eye(3)),
                    "Two slips: Rᵀ stands where R belongs, and I where -I belongs.",
                    id="pivot_matrix-98075a",
                ),
                Mistake(
                    _blocks(lambda R: -R, -np.eye(3)),
                    "The sign of R: R tip + p - pivot = 0, so only the block of the pivot is negative.",
                ),
                Mistake(
                    lambda T_WF: -pivot.pivot_matrix(T_WF)[:, [3, 4, 5, 0, 1, 2]],
                    "The blocks have changed places, and with them their signs: the unknowns are (tip, pivot), so each pose gives [R  -I].",
                ),
                Mistake(
                    _with_pivot_block(lambda n: np.repeat(-np.eye(3), n, axis=0)),
                    "The rows of -I come out of step with those of R: each row comes n times before the next, as `np.repeat` does it. "
                    "`np.tile(-np.eye(3), (n, 1))` repeats the block.",
                    id="pivot_matrix-cfcc5e",
                ),
                Mistake(
                    _with_pivot_block(lambda n: -np.eye(3 * n)[:, :3]),
                    "Only the first pose has its -I: every pose touches the same pivot, so each three rows need one.",
                ),
                Mistake(
                    _with_pivot_block(lambda n: np.zeros((3 * n, 3))),
                    "The block of the pivot is zero. Its place is unknown too: the block is -I.",
                ),
                Mistake(
                    lambda T_WF: np.vstack([np.hstack([T[:3], -np.eye(3)]) for T in T_WF]),
                    "Your rows have seven entries: the position stands between R and -I, as it does in T[:3]. R is T[:3, :3]; p goes to the right-hand side.",
                    id="pivot_matrix-90d825",
                ),
                Mistake(
                    lambda T_WF: pivot.pivot_matrix(T_WF[:1]),
                    "These are the rows of the first pose alone: does `return` stand inside the loop?",
                ),
                Mistake(
                    lambda T_WF: pivot.pivot_matrix(T_WF[-1:]),
                    "These are the rows of the last pose alone: collect the blocks and stack them beneath each other.",
                ),
                Mistake(
                    lambda T_WF: pivot.pivot_matrix(T_WF).T,
                    "This is the transpose: each pose gives three rows, each unknown a column.",
                ),
            ],
        ),
        Exercise(
            "pivot_rhs",
            reference=pivot.pivot_rhs,
            sizes=("T_WF",),
            draw=lambda rng: (poses(rng),),
            metric=metrics.Numbers(1e-9, "mm"),
            noisy=of_few(metrics.Numbers(1e-9, "mm")),
            properties=(right_where(pivot.pivot_rhs, metrics.Numbers(1e-9, "mm"), *special.ALONE),),
            hints=(
                "What is left when tip and pivot stand on the left side?",
                "-p_i, the three positions of pose 1, then those of pose 2, ... in one long vector.",
                "`return -T_WF[:, :3, 3].ravel()`",
            ),
            mistakes=[
                Mistake(lambda T: T[:, :3, 3].ravel(), "The sign: brought to the right side, p becomes -p."),
                Mistake(
                    lambda T: -T[:, :3, 3].T.ravel(),
                    "All x, then all y, then all z: that does not fit the rows of the matrix, which come pose by pose.",
                ),
                Mistake(lambda T: -T[:, :3, 3], "The numbers are right; flatten them into one vector, pose by pose."),
                Mistake(
                    lambda T: -T[:, 3, :3].ravel(),
                    "All zeros. Was nothing filled in, or the last row of each pose taken? The position stands in the last column.",
                    id="pivot_rhs-3a4e58",
                ),
                Mistake(
                    lambda T: -T[:, :, 3].ravel(),
                    "You took the whole last column, the 1 of the last row included: the position is its first three entries.",
                ),
                Mistake(
                    lambda T: -np.einsum("nji,nj->ni", T[:, :3, :3], T[:, :3, 3]).ravel(),
                    "These are the positions turned into the tool frame, -Rᵀp, as in the inverse of a pose. The equations are written in the world: -p.",
                    id="pivot_rhs-1ce2c7",
                ),
                Mistake(
                    lambda T: -np.einsum("nij,nj->ni", T[:, :3, :3], T[:, :3, 3]).ravel(),
                    "You turned the positions by R. They are written in the world already: R belongs to the tip alone.",
                ),
                Mistake(
                    lambda T: -(T[:, :3, 3] - T[:, :3, 3].mean(0)).ravel(),
                    "You took the mean off the positions. That suits a fit without the pivot; here the pivot is one of the unknowns.",
                ),
                Mistake(
                    _entries_overlap,
                    "The positions overwrite each other: each pose takes three entries, so those of pose i begin at 3 * i.",
                    id="pivot_rhs-overlap",
                ),
                Mistake(
                    lambda T: -T[:3, 3].ravel(),
                    "The first index counts the poses, and `:3` takes three of them. All poses, of the last column three entries: T_WF[:, :3, 3].",
                ),
                Mistake(
                    lambda T: -T[:3, :, 3].ravel(),
                    "The first index counts the poses, and `:3` takes three of them. All poses, of the last column three entries: T_WF[:, :3, 3].",
                ),
                Mistake(
                    lambda T: -T[0, :3, 3],
                    "This is the first pose alone: does `return` stand inside the loop?",
                ),
                Mistake(
                    lambda T: -T[-1, :3, 3],
                    "This is the last pose alone: collect the positions of all poses in one long vector.",
                ),
                Mistake(
                    lambda T: T[:, :3, 3],
                    "The sign, and the shape: brought to the right side, p becomes -p, all in one long vector.",
                ),
            ],
        ),
        Exercise(
            "solve_pivot",
            reference=pivot.solve_pivot,
            draw=(system, narrow_system),
            metric=metrics.Numbers(1e-6, "mm"),  # a general minimizer stops some 1e-5 mm away
            noisy=[
                (functools.partial(system, std_trans=1.0, counts=counts), metrics.Numbers(1e-6, "mm"))
                for counts in ((5, 7), (4, 6, 8))
            ]
            + [
                (  # a general minimizer is some 0.01 mm away here; what drops a direction, by many millimeters
                    functools.partial(narrow_system, between_deg=(0.8, 2), ratio=(0.006, 0.0095)),
                    metrics.Numbers(1e-3, "mm"),
                    "right, but not for a very narrow set of poses, whose small singular values count as well:",
                )
            ],
            properties=(right_where(pivot.solve_pivot, metrics.Numbers(1e-4, "mm"), *special.SYSTEMS),),
            hints=(
                "More equations than unknowns: no x fulfills them all. Which x makes the sum of squares of A x - b least?",
                "The sheet: x = (AᵀA)⁻¹ Aᵀb. Better conditioned, and shorter: `np.linalg.lstsq`.",
                "`return np.linalg.lstsq(A, b, rcond=None)[0]`",
            ),
            mistakes=[
                Mistake(
                    lambda A, b: np.linalg.lstsq(A, -b, rcond=None)[0],
                    "The solution comes out negated, as it does with the sign of b reversed.",
                    id="solve_pivot-756de5",
                ),
                Mistake(
                    lambda A, b: np.linalg.lstsq(A[:6], b[:6], rcond=None)[0],
                    "You used the first two poses alone. Use all equations.",
                ),
                Mistake(
                    lambda A, b: np.linalg.pinv(A, rcond=0.1) @ b,
                    "Singular values below a tenth of the largest are dropped here. Narrow poses have such small ones, and they count.",
                    id="solve-cut",
                ),
                Mistake(
                    lambda A, b: A.T @ b,
                    "Aᵀb alone is not the solution: (AᵀA)⁻¹ is missing in front of it.",
                ),
                *(
                    Mistake(
                        lambda A, b, count=count: A.T @ b / count(A),
                        f"This is Aᵀb divided by the number of {what}. The matrix AᵀA is to be undone, and it is no number: "
                        "x = (AᵀA)⁻¹ Aᵀb.",
                        id=f"solve-mean-of-{what}",
                    )
                    for what, count in (("equations", len), ("poses", lambda A: len(A) / 3))
                ),
                Mistake(
                    lambda A, b: np.linalg.lstsq(A, b, rcond=None)[1],
                    "This is the second thing that `lstsq` returns, the sum of squares. The solution is the first, [0].",
                ),
                Mistake(
                    _tip_alone,
                    "The tip is fitted here as if the pivot were at 0. Its place is unknown too: solve for all six at once.",
                    id="solve_pivot-c929a6",
                ),
                Mistake(
                    lambda A, b: np.linalg.lstsq(A, b, rcond=None)[0][[3, 4, 5, 0, 1, 2]],
                    "Tip and pivot have changed places: x = (tip, pivot).",
                ),
                Mistake(
                    lambda A, b: np.linalg.lstsq(A[:9], b[:9], rcond=None)[0],
                    "You used the first three poses alone. They determine x, but the others know something too: use all equations.",
                ),
                Mistake(
                    lambda A, b: np.linalg.lstsq(A, b, rcond=None)[3],
                    "These are the singular values, the last thing that `lstsq` returns. The solution is the first, [0].",
                ),
                Mistake(
                    lambda A, b: A.T @ A @ (A.T @ b),
                    "The inverse is missing: x = (AᵀA)⁻¹ Aᵀb, `np.linalg.solve(A.T @ A, A.T @ b)`.",
                ),
                Mistake(
                    lambda A, b: (A.T @ A) ** -1.0 @ A.T @ b,
                    "Every entry of AᵀA is inverted by itself, as by `** -1`. The inverse matrix is `np.linalg.inv(A.T @ A)`.",
                    id="solve_pivot-690105",
                ),
                Mistake(
                    lambda A, b: pivot.solve_pivot(A, b)[:3],
                    "This is the tip alone. x holds the pivot too: all six numbers are wanted.",
                ),
                Mistake(
                    lambda A, b: A @ pivot.solve_pivot(A, b) - b,
                    "These are the residuals A x - b. The solution x itself is wanted, shape (6,).",
                ),
                Mistake(
                    lambda A, b: np.linalg.solve(A.T @ A + np.eye(6), A.T @ b),
                    "Your solution is pulled toward 0, as by I added to AᵀA, or |x|² to the sum of squares. Least squares solves AᵀA x = Aᵀb as it is.",
                    id="solve-ridge",
                ),
                Mistake(
                    lambda A, b: np.linalg.lstsq(A[-6:], b[-6:], rcond=None)[0],
                    "You used the last two poses alone. Use all equations.",
                    id="solve-last-six",
                ),
                Mistake(
                    lambda A, b: np.abs(np.linalg.lstsq(A, b, rcond=None)[0]),
                    "The signs have got lost: a coordinate of tip or pivot may be negative.",
                    id="solve-abs",
                ),
                Mistake(
                    _total_least_squares,
                    "This is total least squares: it takes the entries of A to be as noisy as b. Asked for is the least sum of squares of A x - b.",
                    id="solve-total",
                ),
                *(
                    Mistake(
                        _without_the_pivot(differences),
                        f"The pivot is eliminated by differences {what}. Their errors are not independent, as one pose is in several of them, so "
                        "least squares of them is another solution where there is noise: solve A x = b for all six.",
                        id=f"solve-differences-{k}",
                    )
                    for k, (what, differences) in enumerate(
                        (
                            ("of neighboring poses", lambda each: np.diff(each, axis=0)),
                            ("from the first pose", lambda each: each[1:] - each[0]),
                        )
                    )
                ),
                Mistake(
                    _one_after_the_other,
                    "You fitted the tip first, as if there were no pivot, then the pivot to what was left. Both share each equation: solve for all six at once.",
                    id="solve-one-after-the-other",
                ),
            ],
        ),
        Value(
            "tip_length",
            reference=lambda: np.linalg.norm(_kreisel().tip),
            unit="mm",
            rtol=1e-3,
            of={
                "x": lambda: np.concatenate([_kreisel().tip, _kreisel().pivot]),
                "the positions of the flange": lambda: lab_sheet.kreisel_poses()[:, :3, 3],
            },
            hints=(
                "Which of the six numbers in x say where the tip is, and seen from where?",
                "The tip seen from the flange is P_t, the first three entries of x. Its length is the root of the sum of squares.",
                "`tip_length = np.linalg.norm(x[:3])`",
            ),
            mistakes=[
                Mistake(
                    lambda: np.linalg.norm(_kreisel().pivot),
                    "This is the distance of the pivot from the robot's base: the last three entries of x. The tip is the first three.",
                ),
                Mistake(
                    lambda: np.hypot(np.linalg.norm(_kreisel().tip), np.linalg.norm(_kreisel().pivot)),
                    "This is the norm of all six entries. The tip is the first three.",
                    id="tip_length-b84ab1",
                ),
                Mistake(
                    lambda: np.linalg.norm(pivot.calibrate_pivot(lab_sheet.kreisel_poses()[:3]).tip),
                    "This is the tip of the first three poses alone. All twelve count.",
                    id="tip-length-three-poses",
                ),
                Mistake(
                    lambda: abs(_kreisel().tip[2]), "This is the z component alone: the tip also sits to the side."
                ),
                Mistake(lambda: _kreisel().tip[2], "This is the z component alone: the tip also sits to the side."),
                Mistake(
                    lambda: np.abs(_kreisel().tip).sum(),
                    "This is the sum of the components' absolute values. The length is the root of the sum of squares.",
                    id="tip_length-b16803",
                ),
                Mistake(
                    lambda: _kreisel().tip.sum(),
                    "This is a sum of components. The length is the root of the sum of squares.",
                    id="tip_length-b16803-2",
                ),
                Mistake(
                    lambda: np.linalg.norm(_kreisel().tip[1:]),
                    "This is the length of y and z alone: Python counts from 0, so the first three entries are x[:3].",
                    id="tip_length-c7acb9",
                ),
                Mistake(
                    lambda: np.linalg.norm(_kreisel().tip[:2]),
                    "This is the length of x and y alone, the distance from the flange's z axis: the slice x[:2] holds two entries.",
                    id="tip_length-f925f0",
                ),
                Mistake(
                    lambda: np.hypot(np.linalg.norm(_kreisel().tip), _kreisel().pivot[0]),
                    "This is the norm of four entries: x[3] is the first coordinate of the pivot. The tip is x[:3].",
                    id="tip-four",
                ),
                Mistake(
                    lambda: np.abs(_kreisel().tip).mean(),
                    "This is the mean of the three components' absolute values. The length is the root of the sum of their squares.",
                    id="tip-mean",
                ),
                Mistake(
                    lambda: (_kreisel().tip ** 2).sum(),
                    "This is the squared length, in mm²: the root is missing.",
                    id="tip-squared",
                ),
                *(
                    Mistake(
                        lambda k=k: np.linalg.norm(lab_sheet.kreisel_poses()[k, :3, 3] - _kreisel().pivot),
                        f"This is how far the flange of poses[{k}] is from the pivot. It is near: the tip misses the pivot a little in "
                        "every pose. The length of the tool itself is that of the tip, x[:3].",
                        id=f"tip-of-pose-{k}",
                    )
                    for k in (0, -1)
                ),
                *(
                    Mistake(
                        lambda pick=pick: pick(
                            np.linalg.norm(lab_sheet.kreisel_poses()[:, :3, 3] - _kreisel().pivot, axis=1)
                        ),
                        f"This is the {word} distance from a flange to the pivot. It is near: the tip misses the pivot a little in every "
                        "pose. The length of the tool itself is that of the tip, x[:3].",
                        id=f"tip-{word}-distance",
                    )
                    for word, pick in (
                        ("largest", np.max),
                        ("smallest", np.min),
                        ("mean", np.mean),
                        ("middle", np.median),
                    )
                ),
                Mistake(
                    lambda: np.linalg.norm(lab_sheet.kreisel_poses()[:, :3, 3].mean(axis=0) - _kreisel().pivot),
                    "This is how far the pivot is from the mean of all flanges, which lies nearer than each of them. The length of the "
                    "tool itself is that of the tip, x[:3].",
                    id="tip-of-mean-flange",
                ),
                Mistake(
                    lambda: np.linalg.norm(_kreisel().tip - _kreisel().pivot),
                    "This is the difference of two points of different frames: the tip is seen from the flange, the pivot from the world.",
                    id="tip_length-a61113",
                ),
                Mistake(
                    lambda: np.linalg.norm(_kreisel().tip) / np.sqrt(3),
                    "This is the rms of the three components. The length is the root of their sum of squares.",
                ),
            ],
        ),
        Exercise(
            "pivot_residuals",
            reference=lambda T_WF, tip, point: pivot.pivot_residuals(T_WF, tip, point),
            sizes=("T_WF", "tip", "point"),
            draw=poses_and_result,
            fixed={"tip": "a point has three coordinates", "point": "a point has three coordinates"},
            metric=metrics.Numbers(1e-9, "mm"),
            noisy=[
                (functools.partial(few_poses_and_points, count=n), metrics.Numbers(1e-9, "mm"), words)
                for n, words in FEW
            ],
            properties=(right_where(pivot.pivot_residuals, metrics.Numbers(1e-9, "mm"), *special.WITH_POINTS),),
            hints=(
                "Where is the tip in each pose, and where should it be?",
                "Equation (2) of the sheet: R_i tip + p_i - point, one row per pose.",
                "`return np.array([T[:3, :3] @ tip + T[:3, 3] - point for T in T_WF])`",
            ),
            mistakes=[
                Mistake(
                    lambda T, tip, point: pivot.pivot_residuals(T, tip, point).reshape(3, -1).T,
                    "The numbers are right and stand in wrong places: pose after pose, three in a row, is `.reshape(-1, 3)`.",
                    id="pivot_residuals-places",
                ),
                Mistake(
                    lambda T, tip, point: point - pivot.pivot_residuals(T, tip, np.zeros(3)),
                    "The sign is reversed: where the tip is, minus where it should be.",
                ),
                Mistake(
                    lambda T, tip, point: np.einsum("nji,j->ni", T[:, :3, :3], tip) + T[:, :3, 3] - point,
                    "You turned the tip by Rᵀ. R takes it from the tool frame to the world.",
                ),
                Mistake(
                    lambda T, tip, point: pivot.pivot_residuals(T, tip, np.zeros(3)),
                    "This is where the tip is. Subtract the pivot.",
                ),
                Mistake(
                    lambda T, tip, point: T[:, :3, :3] @ tip - point,
                    "p is missing: the turned tip still has to be carried to where the flange is.",
                ),
                Mistake(
                    lambda T, tip, point: T[:, :3, :3] @ tip - T[:, :3, 3] - point,
                    "The sign of p: the tip is at R tip + p.",
                ),
                Mistake(
                    lambda T, tip, point: (T[:, :3, :3] * tip).sum(1) + T[:, :3, 3] - point,
                    "You multiplied entry by entry and summed along the wrong axis: R @ tip adds along each row of R.",
                ),
                Mistake(
                    lambda T, tip, point: tip + T[:, :3, 3] - point,
                    "You added the tip without turning it: it is given in the tool frame.",
                ),
                Mistake(
                    lambda T, tip, point: np.linalg.norm(pivot.pivot_residuals(T, tip, point), axis=1),
                    "These are the lengths. The residual has three components in each pose: shape (n, 3).",
                ),
                Mistake(
                    lambda T, tip, point: pivot.pivot_residuals(T, tip, point).ravel(),
                    "The numbers are right; one row per pose is wanted, shape (n, 3).",
                ),
                Mistake(
                    lambda T, tip, point: pivot.pivot_residuals(T, tip, -point),
                    "The sign of the pivot: where the tip is, minus where it should be.",
                ),
                Mistake(
                    lambda T, tip, point: pivot.pivot_residuals(T, point, tip),
                    "Tip and pivot have changed places: R turns the tip, which is given in the tool frame.",
                ),
                Mistake(
                    lambda T, tip, point: (T[:, :3, :3] @ (tip + T[:, :3, 3])[..., None])[..., 0] - point,
                    "You turned p as well. Only the tip is given in the tool frame: R tip + p.",
                ),
                Mistake(
                    lambda T, tip, point: pivot.pivot_residuals(frames.invert(T), point, tip),
                    "You went to the tool frame and compared there. The residual is wanted in the world: R tip + p - point.",
                ),
                Mistake(
                    lambda T, tip, point: -pivot.pivot_residuals(frames.invert(T), point, tip),
                    "You went to the tool frame and compared there. The residual is wanted in the world: R tip + p - point.",
                ),
                Mistake(
                    lambda T, tip, point: T @ np.append(tip, 1.0) - np.append(point, 0.0),
                    "Your rows have four entries: the last is the 1 of the homogeneous point. Drop it.",
                ),
                Mistake(
                    lambda T, tip, point: T @ np.append(tip, 1.0) - np.append(point, 1.0),
                    "Your rows have four entries: the last is 0, the difference of two homogeneous points' 1. Drop it.",
                    id="pivot_residuals-514833-2",
                ),
                Mistake(
                    lambda T, tip, point: np.abs(pivot.pivot_residuals(T, tip, point)),
                    "The sign of each component has got lost: the residual is a vector.",
                ),
                Mistake(
                    lambda T, tip, point: np.square(pivot.pivot_residuals(T, tip, point)),
                    "These are the squares of the components. The residual is a vector: its components as they are, with their signs.",
                    id="pivot_residuals-ffa6a5-2",
                ),
                Mistake(
                    lambda T, tip, point: T[:, :3, :3] * tip + T[:, None, :3, 3] - point,
                    "`*` multiplies entry by entry: R turns the tip by `@`.",
                ),
                Mistake(
                    lambda T, tip, point: pivot.pivot_residuals(T[:1], tip, point)[0],
                    "This is the first pose alone: does `return` stand inside the loop?",
                ),
                Mistake(
                    lambda T, tip, point: pivot.pivot_residuals(T, tip, point).T,
                    "The numbers are right, but each pose stands in a column: one row per pose is wanted, shape (n, 3).",
                ),
                Mistake(
                    lambda T, tip, point: T[:, :3, :3] @ (tip - point) + T[:, :3, 3],
                    "The pivot is turned as well. It is written in the world: only the tip is turned by R.",
                    id="residuals-pivot-turned",
                ),
            ],
        ),
        Value(
            "s0",
            reference=lambda: _kreisel().s0,
            unit="mm",
            rtol=1e-3,
            of={"residuals": lambda: _kreisel().residuals},
            hints=(
                "The sheet's formula, listing 8: the root of the sum of squares over n.",
                "n is the number of poses, not of equations; rᵀr is the sum of the squares of all 3n numbers.",
                "`s0 = np.sqrt((residuals**2).sum() / len(poses))`",
            ),
            mistakes=[
                Mistake(
                    lambda: np.sqrt(_squares() / 36),
                    "This divides by the 36 equations: the rms of one coordinate. The sheet divides by the 12 poses.",
                    id="s0-79bab0",
                ),
                Mistake(
                    lambda: _kreisel().std,
                    "This is the unbiased estimate of one coordinate's noise, divided by 3n - 6. The sheet divides by the 12 poses.",
                    id="s0-63aa00",
                ),
                Mistake(
                    lambda: np.sqrt(_squares() / 11),
                    "This divides by n - 1. The sheet divides by n, the 12 poses.",
                    id="s0-188dc3",
                ),
                Mistake(lambda: np.sqrt(_squares()), "The division by n is missing under the root."),
                Mistake(
                    lambda: np.sqrt(_squares()) / 12,
                    "The n belongs under the root: here it divides after it.",
                    id="s0-76c6e1",
                ),
                Mistake(lambda: _squares() / 12, "The root is missing: this is a variance, in mm²."),
                Mistake(lambda: _squares(), "This is rᵀr. Divide it by n and take the root."),
                Mistake(
                    lambda: _squares() / 36,
                    "The root is missing, and the 36 equations divide instead of the 12 poses.",
                    id="s0-f9e847",
                ),
                Mistake(
                    lambda: np.linalg.norm(_kreisel().residuals, axis=1).std(),
                    "This is how much the lengths differ from their mean. The sheet measures them from zero: the root of their mean square.",
                ),
                Mistake(
                    lambda: np.sqrt(_squares() / 35),
                    "This divides by 36 - 1 (`ddof=1`). The sheet divides by the 12 poses.",
                    id="s0-c439df",
                ),
                Mistake(
                    lambda: np.sqrt(_squares() / 33),
                    "This divides by 36 - 3. The sheet divides by the 12 poses (and there are six unknowns, not three).",
                    id="s0-5dc682",
                ),
                Mistake(
                    lambda: np.sqrt(_squares() / 6),
                    "This divides by 12 - 6. The sheet divides by the 12 poses.",
                    id="s0-bd8b4c",
                ),
                Mistake(
                    lambda: np.linalg.norm(_kreisel().residuals, axis=1).max(),
                    "This is the largest distance. The sheet takes the root of the mean square.",
                ),
                Mistake(
                    lambda: np.linalg.norm(_kreisel().residuals, axis=1).mean(),
                    "This is the mean distance. The sheet takes the root of the mean square, which is a little larger.",
                ),
                Mistake(
                    lambda: np.sqrt((_kreisel().residuals[[0, -1]] ** 2).sum() / 2),
                    "These are the two poses that the sheet prints. All twelve count.",
                    id="s0-two-poses",
                ),
            ],
        ),
        Prediction(
            "spin",
            question="The tool spins about its own axis, sixty poses, never tilted. What will the residual and the error of the tip be?",
            choices=("both small", "both large", "a small residual, a large error"),
            answer="a small residual, a large error",
            why="The residual only says how well the equations are fulfilled. A tip anywhere on the tool's axis fulfills them.",
        ),
        Prediction(
            "two_poses",
            question="Two poses give six equations for six unknowns. Is that enough?",
            choices=("yes, exactly enough", "only with a large turn between them", "never"),
            answer="never",
            why="Whatever the turn between the two poses, it has an axis. A tip shifted along it, with the pivot shifted alike, "
            "fulfills the same equations: R_1 - R_2 has rank 2.",
        ),
        Prediction(
            "cone",
            question="Which set gives the better tip: 60 poses within 2 deg of the vertical, or 6 poses within 20 deg?",
            choices=("60 poses within 2 deg", "6 poses within 20 deg", "both alike"),
            answer="6 poses within 20 deg",
            why="The singular value grows with the angle, but only with the root of the number of poses: a tenfold angle against a "
            "tenfold number is 10 against 3.2.",
        ),
        Exercise(
            "pivot_covariance",
            reference=pivot.pivot_covariance,
            sizes=("residuals",),
            draw=matrix_and_residuals,
            metric=metrics.Numbers(1e-6, "mm^2"),
            noisy=(
                matrix_and_other_residuals,
                metrics.Numbers(1e-6, "mm^2"),
                "Right where the residuals add up to 0, as those of least squares do. Where they do not, as those of rounded numbers:",
            ),
            properties=(
                right_where(pivot.pivot_covariance, metrics.Numbers(1e-6, "mm^2", least=0.0), *special.RESIDUALS),
            ),
            hints=(
                "Noise in b goes through the solution x = (AᵀA)⁻¹ Aᵀb. What does it do to x?",
                "cov = std² (AᵀA)⁻¹, with the unbiased std² = rᵀr / (3n - 6).",
                "`r = residuals.ravel()\nreturn r @ r / (len(r) - 6) * np.linalg.inv(A.T @ A)`",
            ),
            mistakes=[
                Mistake(
                    _covariance(lambda r, n: r @ r / n),
                    "You divided by n, the number of poses. Each pose gives three residuals, and six unknowns are fitted to them: divide by 3n - 6.",
                    id="pivot_covariance-e2d70b",
                ),
                Mistake(
                    _covariance(lambda r, n: r @ r / (3 * n)),
                    "You divided by the number of equations. Six of them were used up by the six unknowns: 3n - 6 remain.",
                ),
                Mistake(
                    lambda A, r: (r**2).sum() / (r.size - 6) * np.diag(1 / np.diag(A.T @ A)),
                    "This is the variance times the reciprocals of the diagonal of AᵀA, as if tip and pivot had nothing to do with each other. Invert the whole matrix: `np.linalg.inv(A.T @ A)`.",
                    id="covariance-of-reciprocals",
                ),
                Mistake(
                    _covariance(lambda r, n: np.sqrt(r @ r / (3 * n - 6))),
                    "A standard deviation stands where its square belongs.",
                ),
                Mistake(
                    _covariance(lambda r, n: 1.0),
                    "This is (AᵀA)⁻¹ for noise of 1 mm. Scale it by the variance of the residuals.",
                ),
                Mistake(
                    lambda A, r: np.vdot(r, r) / (r.size - 6) * (A.T @ A),
                    "You forgot the inverse: AᵀA is the information, and its inverse the covariance.",
                ),
                Mistake(
                    lambda A, r: np.sqrt(np.diag(pivot.pivot_covariance(A, r))),
                    "These are the six standard deviations. The whole matrix is wanted, shape (6, 6).",
                ),
                Mistake(
                    _covariance(lambda r, n: 0.0),
                    "Your covariance is 0. Are the residuals added up before they are squared? Those of least squares add up to 0: sum "
                    "the squares. Or does an array of integers cut it off to 0?",
                    id="covariance-0",
                ),
                Mistake(
                    _variance_of_each_axis,
                    "You took another variance for x, y and z. One noise is meant for all coordinates: one number, from all 3n residuals.",
                    id="covariance-each-axis",
                ),
                Mistake(
                    _covariance(lambda r, n: r @ r / (n - 2)),
                    "Your covariance is three times the right one, as if rᵀr were divided by n - 2, the poses less two. Counted in numbers, 3n - 6 remain.",
                    id="covariance-n-2",
                ),
                Mistake(
                    lambda A, r: np.vdot(r, r) / (r.size - 6) * np.linalg.inv(A.T @ A) @ np.linalg.inv(A.T @ A),
                    "The inverse of AᵀA is in your result twice. It stands there once: std² (AᵀA)⁻¹.",
                    id="covariance-inverse-twice",
                ),
                Mistake(
                    _covariance(lambda r, n: (3 * n - 6) / (r @ r)),
                    "You divided by the variance. More noise makes the result less sure: multiply by it.",
                    id="covariance-divided",
                ),
                Mistake(
                    lambda A, r: np.sqrt(pivot.pivot_covariance(A, r)),
                    "A root of every entry makes no standard deviations of a matrix, and NaN where an entry is negative. The covariance itself is wanted.",
                    id="covariance-root",
                ),
                Mistake(
                    lambda A, r: np.cov(r.T),
                    "This is how the residuals scatter in x, y, z. What is wanted is what such noise does to the six unknowns: std² (AᵀA)⁻¹.",
                    id="covariance-of-residuals",
                ),
                Mistake(
                    _covariance(lambda r, n: r @ r / (n - 6)),
                    "You counted poses where equations are meant: 3n - 6 degrees of freedom.",
                ),
                Mistake(
                    _covariance(lambda r, n: r @ r / (n - 1)),
                    "You counted poses where equations are meant: 3n - 6 degrees of freedom.",
                ),
                Mistake(
                    _covariance(lambda r, n: r @ r / (3 * n - 1)),
                    "You divided by 3n - 1, as if one mean had been estimated. Six unknowns were: 3n - 6 remain.",
                ),
                Mistake(
                    _covariance(lambda r, n: r @ r / (3 * n - 3)),
                    "You divided by 3n - 3: the pivot is unknown as well as the tip, so 3n - 6 remain.",
                ),
                Mistake(
                    _covariance(lambda r, n: r @ r),
                    "rᵀr grows with the number of poses. The variance of one coordinate is rᵀr / (3n - 6).",
                ),
                Mistake(
                    _covariance(lambda r, n: np.sqrt(r @ r / (3 * n))),
                    "A standard deviation stands where the variance belongs, and it is divided by 3n in place of 3n - 6.",
                ),
                Mistake(
                    _covariance(lambda r, n: np.sqrt(r @ r / n)),
                    "This is the sheet's s0 times (AᵀA)⁻¹. What belongs there is the variance of one coordinate, rᵀr / (3n - 6).",
                ),
                Mistake(
                    lambda A, r: np.diag(pivot.pivot_covariance(A, r)),
                    "These are the six variances. The whole matrix is wanted, shape (6, 6).",
                ),
                Mistake(
                    lambda A, r: np.diag(np.diag(pivot.pivot_covariance(A, r))),
                    "You kept the diagonal alone. The errors of tip and pivot go together: the whole matrix is wanted.",
                ),
                Mistake(
                    lambda A, r: pivot.pivot_covariance(A, r)[:3, :3],
                    "This is the block of the tip. The covariance of all six unknowns is wanted, shape (6, 6).",
                ),
                Mistake(
                    lambda A, r: np.vdot(r, r) / (r.size - 6) * (A.T @ A) ** -1.0,
                    "You took the reciprocal of every entry. The inverse matrix is `np.linalg.inv(A.T @ A)`.",
                ),
                Mistake(
                    lambda A, residuals: np.linalg.norm(residuals, axis=1).mean() ** 2 * np.linalg.inv(A.T @ A),
                    "The squared mean distance in space stands for the variance of a coordinate. That is rᵀr / (3n - 6).",
                    id="covariance-mean-distance",
                ),
                Mistake(
                    lambda A, residuals: _correlation(np.linalg.inv(A.T @ A)),
                    "These are correlations, without a unit. The covariance is std² (AᵀA)⁻¹, in mm².",
                    id="covariance-correlation",
                ),
                *(
                    Mistake(
                        _each_its_own(factor),
                        "Each equation counts here with its own residual squared. The noise is the same in all: one variance, rᵀr / (3n - 6), "
                        "stands in front of (AᵀA)⁻¹.",
                        id=f"covariance-each-its-own-{k}",
                    )
                    for k, factor in enumerate((lambda n: 1.0, lambda n: 3 * n / (3 * n - 6)))
                ),
            ],
        ),
        Exercise(
            "robust_weights",
            reference=_tukey_weights,
            sizes=("distances scale", "distances", "scale"),
            draw=tuple(functools.partial(draw, count=n) for n in (11, 6) for draw in (near_first, far_first)),
            metric=metrics.Numbers(1e-9),
            properties=(right_where(_tukey_weights, metrics.Numbers(1e-9), *special.DISTANCES),),
            noisy=[
                (one_at_0, metrics.Numbers(1e-9), "right, but not where a distance is 0:"),
                (all_far, metrics.Numbers(1e-9), "right, but not where all poses are too far away:"),
                (one_alone, metrics.Numbers(1e-9), "right, but not for a single distance:"),
            ],
            hints=(
                "Near poses keep their weight, far ones lose it all, smoothly.",
                "Tukey: with q = d / (7 scale), w = (1 - q^2)^2, and 0 where q > 1.",
                "`q = distances / (7 * scale)\nreturn np.where(q < 1, (1 - q**2) ** 2, 0.0)`",
            ),
            mistakes=[
                Mistake(
                    _weights(lambda q: (1 - q**2) ** 2),
                    "Beyond the cutoff your weights grow again: (1 - q^2)^2 must be cut to 0 where q > 1.",
                ),
                Mistake(
                    _weights(lambda q: np.maximum(1 - q**2, 0)),
                    "Your weights are 1 - q^2. Tukey's are the squares of these, (1 - q^2)^2, and no root is taken of them.",
                    id="robust_weights-efee08",
                ),
                Mistake(
                    _weights(lambda q: np.maximum(1 - q, 0) ** 2),
                    "The inner square is missing: w = (1 - q^2)^2.",
                ),
                Mistake(
                    _weights(lambda q: (q < 1).astype(float)),
                    "You cut hard: a pose is in or out. Tukey's weights fall to zero smoothly.",
                ),
                Mistake(
                    lambda distances, scale: np.maximum(1 - (distances / scale) ** 2, 0) ** 2,
                    "The cutoff is 7 times the scale. Here the weights are 0 from the scale itself on.",
                    id="robust_weights-c7dddb",
                ),
                Mistake(
                    lambda distances, scale: np.maximum(1 - (distances / pivot.TUKEY) ** 2, 0) ** 2,
                    "You did not divide by the scale: the cutoff is 7 standard deviations, not 7 mm.",
                ),
                Mistake(
                    lambda distances, scale: np.maximum(1 - (distances / pivot.TUKEY * scale) ** 2, 0) ** 2,
                    "The scale multiplies here, as in `d / 7 * scale`. It divides: q = d / (7 scale).",
                    id="robust_weights-18a384",
                ),
                Mistake(
                    _weights(lambda q: np.where(q > 1, (1 - q**2) ** 2, 0.0)),
                    "Your weights are 0 within the cutoff and grow beyond it. The other way round: 0 belongs beyond it, where q > 1.",
                    id="robust_weights-2b7532",
                ),
                Mistake(
                    _weights(lambda q: (1 - np.maximum(1 - q**2, 0) ** 3) / 6),
                    "This is Tukey's loss, which grows with the distance. Its weight falls: (1 - q^2)^2, and 0 beyond the cutoff.",
                    id="robust_weights-loss",
                ),
                Mistake(
                    _weights(lambda q: 1 - np.maximum(1 - q**2, 0) ** 2),
                    "The wrong way round: near poses get 0 and far ones 1.",
                ),
                Mistake(
                    lambda distances, scale: np.where(
                        distances > scale, 0.0, (1 - (distances / (pivot.TUKEY * scale)) ** 2) ** 2
                    ),
                    "You cut at one scale. The weight reaches 0 at 7 scales, where q = 1.",
                ),
                Mistake(
                    lambda distances, scale: np.where(
                        distances < pivot.TUKEY, (1 - (distances / (pivot.TUKEY * scale)) ** 2) ** 2, 0.0
                    ),
                    "You cut at 7 mm. The weight reaches 0 at 7 scales, where q = 1.",
                ),
                Mistake(
                    lambda distances, scale: np.maximum(1 - (distances / scale * pivot.TUKEY) ** 2, 0) ** 2,
                    "The 7 multiplies here, as in `d / scale * 7`. It divides: q = d / (7 scale).",
                    id="robust_weights-7cabcf",
                ),
                Mistake(
                    lambda distances, scale: np.where(
                        distances < pivot.TUKEY * scale, (1 - distances**2 / (pivot.TUKEY * scale)) ** 2, 0.0
                    ),
                    "Only d is squared. Square the whole quotient q = d / (7 scale).",
                ),
                Mistake(
                    lambda distances, scale: np.maximum(1 - (distances / (4.685 * scale)) ** 2, 0) ** 2,
                    "4.685 is the usual cutoff for single numbers. Distances in space are larger: here it is 7 scales.",
                ),
                Mistake(
                    _weights(lambda q: np.where(q < 1, (1 - q**2) ** 2, 1.0)),
                    "Beyond the cutoff a pose has no weight: 0, not 1.",
                ),
                Mistake(
                    _weights(lambda q: np.minimum((1 - q**2) ** 2, 1.0)),
                    "Beyond the cutoff your weights grow again, up to 1: they must be 0 where q > 1.",
                    id="robust_weights-29036c-2",
                ),
                Mistake(
                    _weights(lambda q: (lambda w: w / w.sum())(np.maximum(1 - q**2, 0) ** 2)),
                    "You made the weights add up to 1. They are wanted as they are: 1 for a pose that agrees perfectly.",
                ),
                Mistake(
                    _weights(lambda q: (1 - (q / max(q.max(initial=0.0), 1.0)) ** 2) ** 2),
                    "Your cutoff grows with the largest distance, so that one bad pose gives weight to all others. It is 7 scales, however far the "
                    "farthest pose is.",
                    id="weights-cutoff-at-the-farthest",
                ),
                Mistake(
                    _weights(lambda q: (1 - q[q < 1] ** 2) ** 2),
                    "You left out the far poses. They keep their place and get the weight 0.",
                ),
                Mistake(
                    _weights(lambda q: np.where(q < 1, np.trunc((1 - q**2) ** 2), 0.0)),
                    "All your weights are 0. Does one far pose decide for all of them? Or was the array made of integers, "
                    "which cut a weight below 1 off to 0?",
                    id="robust_weights-cc038c",
                ),
                Mistake(
                    _weights(np.vectorize(lambda q: (1 - q**2) ** 2 if q < 1 else 0)),
                    "Where the first weight is 0, all of them become whole numbers, as with `np.vectorize`, which takes the type of its first result. Write 0.0.",
                    id="robust_weights-3109df",
                ),
                Mistake(
                    _weights(lambda q: np.maximum(1 - q**4, 0)),
                    "The square belongs around 1 - q^2, not on q^2: w = (1 - q^2)^2.",
                ),
                Mistake(
                    _weights(lambda q: np.minimum(1, 1 / q)),
                    "These are Huber's weights: they never vanish, so a pose far away still pulls.",
                ),
                Mistake(
                    lambda d, scale: np.where(d < 7 * scale, (1 - (d / (7 * scale)) ** 3) ** 3, 0.0),
                    "These are third powers (tricube). Tukey's weights have squares: (1 - q^2)^2.",
                    id="weights-tricube",
                ),
                Mistake(
                    lambda d, scale: np.where(d**2 < 7 * scale, (1 - d**2 / (7 * scale)) ** 2, 0.0),
                    "Only the distance is squared: q^2 is the square of the whole quotient, d / (7 scale).",
                    id="weights-squared-distance",
                ),
                Mistake(
                    lambda d, scale: np.exp(-((d / scale) ** 2) / 2),
                    "This is a Gaussian bell, with no cutoff. Tukey's weights are (1 - q^2)^2, and 0 where q > 1.",
                    id="weights-bell",
                ),
                Mistake(
                    lambda d, scale: 1 / (1 + (d / (7 * scale)) ** 2),
                    "These are Cauchy's weights: they never vanish, so a pose far away still pulls.",
                    id="weights-cauchy",
                ),
            ],
        ),
        Prediction(
            "outliers",
            question="Three of twelve touches are a few millimeters beside the point. How far off is the plain tip, with noise of 0.2 mm?",
            choices=("like the noise, about 0.1 mm", "about a millimeter", "not at all, errors average out"),
            answer="about a millimeter",
            why="Squares listen to the loudest. The robust calibration notices that nine poses agree, and lets go of three.",
        ),
    ],
)
