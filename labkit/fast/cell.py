"""A part that is found again, for a figure that is dragged: every pose of one cell from few products; equals
`machines.cell`.

The hole goes through the chain as a point, T_BW T_WE1 T_WE0^-1 T_BW^-1 T_BP0 hole, and each error enters where the
point has come to: before a turn by phi it stands at v, behind it at R (v + phi x v). Cells and jobs are taken as sound,
one at a time, and three marks on a line are not refused; what is neither is.
"""

from dataclasses import replace

import numpy as np

from ..checks import as_choice, as_instance, as_shape
from ..geometry.lie import _exp_so3, _skew
from ..machines.cell import Cell, Job

_I3 = np.eye(3)
_SIZES = {"tip": 3, "scanner": 6, "tracker": 6, "marks": 9, "first reading": 6, "second reading": 6}
_TURNED = {"scanner": "T_FS", "tracker": "T_BW", "first reading": "T_WE0", "second reading": "T_WE1"}


def with_errors(cell, job, errors):
    """The cell and the job that are used, each source with its error: `labkit.machines.cell.with_errors`, of one each.

    Parameters
    ----------
    cell : Cell
    job : Job
    errors : dict
        {source: array, shape (n,)}; what is not named stays.

    Returns
    -------
    cell : Cell
    job : Job

    Raises
    ------
    ValueError
        A source that there is not, an error of another shape.
    """
    _refuse(cell, job)
    of_cell, of_job = {}, {}
    for name, error in _as_errors(errors).items():
        if name == "tip":
            of_cell["tip"] = cell.tip + error
        elif name == "marks":
            of_job["marks"] = job.marks + error.reshape(3, 3)
        else:
            attribute, of = _TURNED[name], of_cell if name in ("scanner", "tracker") else of_job
            T = getattr(cell if of is of_cell else job, attribute).copy()
            T[:3, :3] = T[:3, :3] @ _exp_so3(error[:3])
            T[:3, 3] += error[3:]
            of[attribute] = T
    return replace(cell, **of_cell), replace(job, **of_job)


def learned_pose(cell, job):
    """T_BP0, the frame through the marks, shape (4, 4): `labkit.machines.cell.learned_pose`."""
    _refuse(cell, job)
    T = np.zeros((4, 4))
    T[:3, :3], T[:3, 3], T[3, 3] = _axes(marks := _marks(cell, job)), marks[0], 1.0
    return T


def part_pose(cell, job):
    """T_BP, where the part is now, shape (4, 4): `labkit.machines.cell.part_pose`."""
    _refuse(cell, job)
    return cell.T_BW @ job.T_WE1 @ _inverse(cell.T_BW @ job.T_WE0) @ learned_pose(cell, job)


def flange_at_hole(cell, job):
    """Flange pose that brings the tip to the hole, shape (4, 4): `labkit.machines.cell.flange_at_hole`."""
    _refuse(cell, job)
    part, T = part_pose(cell, job), np.zeros((4, 4))
    T[:3, :3], T[3, 3] = job.R_tool, 1.0
    T[:3, 3] = part[:3, :3] @ job.hole + part[:3, 3] - job.R_tool @ cell.tip
    return T


def _refuse(cell, job):
    as_instance(cell, "cell", Cell)
    as_instance(job, "job", Job)


def _as_errors(errors, *rows):
    """The errors as arrays, each of its own shape."""
    names = [as_choice(name, "errors", _SIZES) for name in as_instance(errors, "errors", dict)]
    return {name: as_shape(errors[name], name, *rows, _SIZES[name]) for name in names}


def _marks(cell, job):
    """The three marks in the base, as rows."""
    seen = cell.tip + job.marks if job.touched else job.marks @ cell.T_FS[:3, :3].T + cell.T_FS[:3, 3]
    return (job.T_BF[:, :3, :3] @ seen[..., None])[..., 0] + job.T_BF[:, :3, 3]


def _axes(marks):
    """The axes through three marks, (3, 3), as columns."""
    x, b = marks[1] - marks[0], marks[2] - marks[0]
    x = x / np.sqrt(x @ x)
    y = b - (x @ b) * x
    y = y / np.sqrt(y @ y)
    return np.array([x, y, _cross(x, y)]).T


def _cross(a, b):
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


def _inverse(T):
    inverse = np.zeros((4, 4))
    inverse[:3, :3], inverse[3, 3] = T[:3, :3].T, 1.0
    inverse[:3, 3] = -(T[:3, 3] @ T[:3, :3])
    return inverse


# ---- how sure it is --------------------------------------------------------------------------------------------------


def miss_budget(cell, job):
    """What each source contributes to the covariance of the miss: `labkit.machines.cell.miss_budget`.

    Parameters
    ----------
    cell : Cell
    job : Job

    Returns
    -------
    shares : dict
        {source: array, shape (3, 3), mm^2}; their sum is the covariance.
    """
    _refuse(cell, job)
    variance = np.repeat(np.square(job.std_reading), 3)
    J, known = _miss_jacobians(cell, job), {"tip": cell.cov_tip, "scanner": cell.cov_FS, "tracker": cell.cov_BW}
    diagonal = {"marks": job.std_mark**2, "first reading": variance, "second reading": variance}
    return {name: (by @ known[name] if name in known else by * diagonal[name]) @ by.T for name, by in J.items()}


def _miss_jacobians(cell, job):
    """How the miss moves with each source, {source: (3, n)}."""
    (R_W, t_W), (R_0, t_0), (R_1, t_1) = ((T[:3, :3], T[:3, 3]) for T in (cell.T_BW, job.T_WE0, job.T_WE1))
    marks = _marks(cell, job)
    R_P = _axes(marks)
    in_world = (marks[0] + R_P @ job.hole - t_W) @ R_W  # the hole, as the chain carries it on
    at_tracker = (in_world - t_0) @ R_0
    moved_on = R_1 @ at_tracker + t_1
    R_W1 = R_W @ R_1
    R_W10 = R_W1 @ R_0.T
    by_tip, by_scanner, by_marks = _by_marks(cell, job, R_W10 @ R_W.T @ _hole_by_marks(marks, R_P, job.hole))
    return {
        "tip": by_tip - job.R_tool,
        "scanner": by_scanner,
        "marks": by_marks,
        "tracker": np.hstack([R_W10 @ _skew(in_world) - R_W @ _skew(moved_on), _I3 - R_W10 @ R_W.T]),
        "first reading": np.hstack([R_W1 @ _skew(at_tracker), -R_W10]),
        "second reading": np.hstack([-R_W1 @ _skew(at_tracker), R_W]),
    }


def _hole_by_marks(marks, R_P, hole):
    """How the hole of the part as learned moves with its marks in the base, (3, 9)."""
    into = R_P.T
    a = np.linalg.norm(marks[1] - marks[0])
    b, h = (into @ (marks[2] - marks[0]))[:2]
    turn = np.zeros((3, 9))  # about the part's axes
    turn[2, 3:6], turn[2, :3] = into[1] / a, -into[1] / a
    turn[1, 3:6], turn[1, :3] = -into[2] / a, into[2] / a
    turn[0] = b * turn[1]
    turn[0, 6:] += into[2]
    turn[0, :3] -= into[2]
    turn[0] /= h
    J = -R_P @ _skew(hole) @ turn
    J[:, :3] += _I3
    return J


def _by_marks(cell, job, J):
    """What moves with the marks in the base by J (3, 9), by tip (3, 3), scanner (3, 6) and marks (3, 9)."""
    R, J = job.T_BF[:, :3, :3], J.reshape(3, 3, 3).swapaxes(0, 1)  # a block (3, 3) for each mark
    turned = J @ R
    if job.touched:
        return turned.sum(0), np.zeros((3, 6)), turned.swapaxes(0, 1).reshape(3, 9)
    by_mark = turned @ cell.T_FS[:3, :3]
    by_turn = -(by_mark @ _skew(job.marks)).sum(0)
    return np.zeros((3, 3)), np.hstack([by_turn, turned.sum(0)]), by_mark.swapaxes(0, 1).reshape(3, 9)


class Misses:
    """The same errors in one cell after the other; their turns are worked out once.

    Parameters
    ----------
    errors : dict
        {source: array, shape (n, k)}, of every source, as `labkit.machines.cell.draw_errors` draws them.
    """

    def __init__(self, errors):
        self.errors = _as_errors(errors, "n")
        if set(self.errors) != set(_SIZES) or len({len(error) for error in self.errors.values()}) != 1:
            raise ValueError(f"errors must hold as many of each source: {', '.join(_SIZES)}")
        self.turns = {name: _exp_so3(self.errors[name][:, :3]) for name in _TURNED}

    def of(self, cell, job):
        """The miss of the hole with each of them, shape (n, 3): `labkit.machines.cell.misses_by`."""
        _refuse(cell, job)
        e = self.errors
        hole = self._learned_hole(cell, job)
        for name, T in (("tracker", cell.T_BW), ("first reading", job.T_WE0)):
            hole = np.einsum("mji,mj->mi", self.turns[name], (hole - T[:3, 3] - e[name][:, 3:]) @ T[:3, :3])
        for name, T in (("second reading", job.T_WE1), ("tracker", cell.T_BW)):
            hole = np.einsum("mij,mj->mi", self.turns[name], hole) @ T[:3, :3].T + T[:3, 3] + e[name][:, 3:]
        part = part_pose(cell, job)
        return hole - e["tip"] @ job.R_tool.T - (part[:3, :3] @ job.hole + part[:3, 3])

    def _learned_hole(self, cell, job):
        """The hole of the part as it was learned, in the base, (n, 3)."""
        seen = job.marks + self.errors["marks"].reshape(-1, 3, 3)
        if job.touched:
            seen += (cell.tip + self.errors["tip"])[:, None]
        else:
            R, t = cell.T_FS[:3, :3], cell.T_FS[:3, 3]
            seen = seen @ (R @ self.turns["scanner"]).swapaxes(1, 2) + (t + self.errors["scanner"][:, 3:])[:, None]
        R, t = job.T_BF[:, :3, :3], job.T_BF[:, :3, 3]
        o, x, b = seen.swapaxes(0, 1) @ R.swapaxes(1, 2) + t[:, None]
        x, b = x - o, b - o
        x = x / np.sqrt(np.einsum("mi,mi->m", x, x))[:, None]
        y = b - np.einsum("mi,mi->m", x, b)[:, None] * x
        y = y / np.sqrt(np.einsum("mi,mi->m", y, y))[:, None]
        z = x[:, [1, 2, 0]] * y[:, [2, 0, 1]] - x[:, [2, 0, 1]] * y[:, [1, 2, 0]]
        return o + job.hole[0] * x + job.hole[1] * y + job.hole[2] * z
