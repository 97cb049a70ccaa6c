"""One call from one's own poses to a calibration with covariance, outliers and advice.

    from labkit.calibration import calibrate

    result = calibrate.hand_eye(robot, sensor)      # (N, 4, 4) each
    result.T, result.std, result.rejected, result.advice

Every function fits all rows and, beside that, the rows that agree with the majority; the second is the result, the
first stands in `plain`. Lengths in any unit: `length_unit` only names it.
"""

from dataclasses import dataclass, field

import numpy as np

from ..checks import as_points, as_shape, as_transforms
from ..documented import documented
from ..estimation.clocks import clock_offset, longest_step, sample_stream
from ..estimation.influence import inverse_normal, leave_out
from ..geometry.frames import invert, pose_distance
from ..geometry.lie import log_so3
from . import advice
from .ax_xb import calibrate_hand_eye
from .hand_eye import calibrate_sphere_target
from .own_data import (
    FrameModel,
    HandEyeModel,
    PivotModel,
    SphereModel,
    majority,
    next_poses,
    three_point_frame,
)

POSE = ("rotation x", "rotation y", "rotation z", "translation x", "translation y", "translation z")
MANY_REJECTED = 0.2  # of the rows
FEW_FREEDOM = 8.0  # degrees of freedom of an estimated noise: with fewer it is off by a quarter and more
LOOSE = 0.1  # of the spread of the positions: residuals as large are more than noise
FIT_ROWS = 300  # of two streams, spread evenly: neighbors say the same
FASTEST_BINS = 6
BLOCKS = 12  # of a stream, left out in turn
SHARED = 2.0  # times the variance: 200 simulated streams of independent samples came out at 0.56 to 1.92


@dataclass(frozen=True, eq=False)
class Plain:
    """The fit to all rows, outliers among them: T (4, 4), rms_rotation_deg and rms_translation."""

    T: np.ndarray
    rms_rotation_deg: float
    rms_translation: float


@dataclass(frozen=True, eq=False)
class Calibration:
    """What one's own data say.

    kind: hand-eye, pivot, sphere, frame or compare. meaning: what T is, in words. T: (4, 4). points: named points such
    as tip, pivot, center. T_target: (4, 4) or None. covariance: (6, 6), in the order `parameters`; where the noise is
    estimated it is that of Student's law. noise: standard deviations of a reading, told or estimated; noise_freedom:
    the degrees of freedom of that estimate, infinite where told. residuals: (n, k), rotation vector (rad) before
    translation. kept: bool (n,). alone: residuals (n, k) of each row under the fit to the other kept rows.
    group_shifts: {group: how far the estimate moves without it (6,)}.
    """

    kind: str
    meaning: str
    length_unit: str
    T: np.ndarray
    covariance: np.ndarray
    residuals: np.ndarray
    kept: np.ndarray
    singular_values: np.ndarray
    noise: dict
    plain: Plain | None
    points: dict = field(default_factory=dict)
    parameters: tuple = POSE
    T_target: np.ndarray | None = None
    alone: np.ndarray | None = None
    group_shifts: dict = field(default_factory=dict)
    advice: tuple = ()
    warnings: tuple = ()
    next_poses: np.ndarray | None = None
    next_std: np.ndarray | None = None
    time_offset: object = None
    comparison: object = None
    poses: np.ndarray | None = None
    noise_freedom: dict = field(default_factory=dict)

    @property
    def rows(self):
        """Number of rows."""
        return len(self.kept)

    @property
    def rejected(self):
        """Numbers of the rejected rows, from 1."""
        return [int(k) + 1 for k in np.flatnonzero(~self.kept)]

    @property
    def std(self):
        """Standard deviations of the six parameters, (6,): rad and the length unit."""
        return np.sqrt(np.diagonal(self.covariance))

    @property
    def rms_rotation_deg(self):
        """Root mean square angle of the kept residuals (deg), NaN where only points were measured."""
        return _rms(self.residuals[self.kept])[0]

    @property
    def rms_translation(self):
        """Root mean square distance of the kept residuals."""
        return _rms(self.residuals[self.kept])[1]

    def as_dict(self):
        """The result as `result.json` holds it: plain lists and numbers, None where a number is unknown."""
        found = {
            "kind": self.kind,
            "meaning": self.meaning,
            "length_unit": self.length_unit,
            "T": self.T,
            "T_target": self.T_target,
            **self.points,
            "covariance": self.covariance,
            "covariance_order": list(self.parameters),
            "std": self.std,
            "rms_rotation_deg": self.rms_rotation_deg,
            "rms_translation": self.rms_translation,
            "noise": self.noise,
            "noise_freedom": self.noise_freedom,
            "rows": self.rows,
            "rejected": self.rejected,
            "singular_values": self.singular_values,
            "time_offset": self.time_offset and {"offset": self.time_offset.offset, "std": self.time_offset.std},
            "plain": self.plain
            and {
                "T": self.plain.T,
                "rms_rotation_deg": self.plain.rms_rotation_deg,
                "rms_translation": self.plain.rms_translation,
            },
            "group_shifts": {f"{k:g}": v for k, v in self.group_shifts.items()} or None,
            "advice": list(self.advice),
            "next_poses": self.next_poses,
            "next_std": self.next_std,
            "comparison": self.comparison and self.comparison.as_dict(),
            "warnings": list(self.warnings),
        }
        return _listed(found)

    def lines(self):
        """The result in a few lines of text."""
        unit, std = self.length_unit, self.std
        out = [f"{self.meaning} ({unit}):"]
        if self.kind == "pivot":
            for k, (name, point) in enumerate(self.points.items()):
                out.append(f"  {name:<12}{_numbers(point)}  +- {_numbers(std[3 * k : 3 * k + 3])}")
        else:
            turn = np.rad2deg(log_so3(self.T[:3, :3]))
            out.append(f"  translation {_numbers(self.T[:3, 3])}  +- {_numbers(std[3:])}")
            out.append(f"  rotation    {_numbers(turn)} deg (rotation vector)  +- {_numbers(np.rad2deg(std[:3]))}")
        out += [f"  {name:<12}{_numbers(point)}" for name, point in self.points.items() if self.kind != "pivot"]
        rms = f"rms {self.rms_translation:.4g} {unit}"
        if np.isfinite(self.rms_rotation_deg):
            rms += f" and {self.rms_rotation_deg:.4g} deg"
        out.append(f"{int(self.kept.sum())} of {self.rows} rows agree, {rms}")
        if self.rejected:
            out.append(f"rejected rows: {', '.join(map(str, self.rejected))}")
        if self.time_offset:
            out.append(f"clock offset {1e3 * self.time_offset.offset:.3f} ms +- {1e3 * self.time_offset.std:.3f} ms")
        if self.comparison:
            out += self.comparison.lines(unit)
        return out + [f"warning: {w}" for w in self.warnings] + list(self.advice)

    def __repr__(self):
        return "\n".join(self.lines())

    def _repr_html_(self):
        head = "".join(f"<th>{w}</th>" for w in ("", "x", "y", "z", "standard deviations"))
        rows = "".join(
            f"<tr><th>{name}</th>" + "".join(f"<td>{v:.5g}</td>" for v in values) + f"<td>{_numbers(std)}</td></tr>"
            for name, values, std in self._table()
        )
        notes = "".join(f"<li>{_escaped(line)}</li>" for line in (*self.warnings, *self.advice))
        unit = self.length_unit
        caption = (
            f"<caption>{_escaped(self.meaning)}; {int(self.kept.sum())} of {self.rows} rows agree, "
            f"rms {self.rms_translation:.4g} {unit}</caption>"
        )
        return f"<table>{caption}<tr>{head}</tr>{rows}</table>" + (f"<ul>{notes}</ul>" if notes else "")

    def _table(self):
        """(name, three values, three standard deviations) as they are shown."""
        std, unit = self.std, self.length_unit
        if self.kind == "pivot":
            return [(f"{n} [{unit}]", p, std[3 * k : 3 * k + 3]) for k, (n, p) in enumerate(self.points.items())]
        turn = np.rad2deg(log_so3(self.T[:3, :3]))
        return [(f"translation [{unit}]", self.T[:3, 3], std[3:]), ("rotation vector [deg]", turn, np.rad2deg(std[:3]))]


@dataclass(frozen=True, eq=False)
class Comparison:
    """How far the second stream is from the first, sample by sample.

    time (n,) s, rotation_deg (n,), translation (n,), speed (n,) length unit per second; table: rows (from, to, count,
    rms deg, rms translation) over speed.
    """

    time: np.ndarray
    rotation_deg: np.ndarray
    translation: np.ndarray
    speed: np.ndarray
    table: list
    unmatched: int

    def as_dict(self):
        """The summary that result.json holds."""
        names = ("speed_from", "speed_to", "samples", "rms_rotation_deg", "rms_translation")
        return {
            "samples": len(self.time),
            "unmatched": self.unmatched,
            "over_speed": [dict(zip(names, row)) for row in self.table],
        }

    def lines(self, unit):
        """The table over speed as text."""
        head = [
            f"{len(self.time)} samples compared, {self.unmatched} of the second stream in gaps or outside the first"
        ]
        return head + [
            f"  {a:8.3g} to {b:8.3g} {unit}/s: {n:6d} samples, rms {angle:.4g} deg, {length:.4g} {unit}"
            for a, b, n, angle, length in self.table
        ]


# --- the kinds -------------------------------------------------------------------------------------------------------


@documented
def hand_eye(
    robot, sensor, *, eye_to_hand=False, std_rot=None, std_trans=None, groups=None, length_unit="mm", judge_roles=True,
    solver=calibrate_hand_eye,
):  # fmt: skip
    """Where a sensor sits on a flange, or beside the robot, from poses of both.

    Parameters
    ----------
    robot : array-like, shape (N, 4, 4)
        Flange in base.
    sensor : array-like, shape (N, 4, 4)
        Target in sensor.
    eye_to_hand : bool
        The sensor stands still and the flange carries the target.
    std_rot, std_trans : float, optional
        Noise of a reading per axis (rad, length unit); estimated without them.
    groups : array-like, shape (N,), optional
        Rows that belong together, to be left out together as well.
    length_unit : str
    judge_roles : bool
        Refuse data whose inverses fit far better.
    solver : callable
        Fits a mounting; `fast.ax_xb.calibrate_hand_eye` gives the same and is quick.

    Returns
    -------
    Calibration
        T is the sensor in the flange, or in the base; T_target the target in the base, or in the flange.

    Raises
    ------
    ValueError
        One sentence: poses that do not turn enough, roles that seem mixed up, no majority.
    """
    robot = as_transforms(robot, "robot")
    model = HandEyeModel(invert(robot) if eye_to_hand else robot, sensor, (std_rot, std_trans), solver)
    advice.refuse_one_axis(model.T_BF)
    if judge_roles:
        advice.refuse_mixed_roles(model, eye_to_hand)
    solution, kept = majority(model)
    advice.refuse_open_loop(model.T_BF[kept], model.linearize(solution)[0][kept], length_unit)
    frame = "base" if eye_to_hand else "flange"
    plain = _attempt(lambda: model.fitted(np.ones(model.n, bool)))
    found = _assembled(
        model, solution, kept, plain, groups, length_unit,
        kind="hand-eye", meaning=f"sensor in the {frame}", T=solution[0], T_target=solution[1], frame=frame,
    )  # fmt: skip
    proposals, course = next_poses(model, solution, kept)
    proposals = invert(proposals) if eye_to_hand else proposals
    warnings = found.warnings + _moved(model, kept, length_unit)
    return _with(found, next_poses=proposals, next_std=course, warnings=warnings, poses=robot)


@documented
def pivot(poses, *, groups=None, length_unit="mm"):
    """Tip of a tool and the point it touches, from poses that all touch it.

    Parameters
    ----------
    poses : array-like, shape (N, 4, 4)
    groups : sequence, optional
        As in `hand_eye`.
    length_unit : str

    Returns
    -------
    Calibration
        T is a translation to the tip: its orientation is not determined. covariance is of tip and pivot.
    """
    model = PivotModel(poses)
    advice.refuse_one_axis(model.T_WF, "the tool")
    solution, kept = majority(model)
    plain = _attempt(lambda: model.fitted(np.ones(model.n, bool)))
    tip, point = solution
    T = np.eye(4)
    T[:3, 3] = tip
    names = tuple(f"{name} {axis}" for name in ("tip", "pivot") for axis in "xyz")
    found = _assembled(
        model, solution, kept, plain, groups, length_unit,
        kind="pivot", meaning="tip in the tool", T=T, points={"tip": tip, "pivot": point}, frame="tool",
    )  # fmt: skip
    proposals, course = next_poses(model, solution, kept)
    return _with(found, parameters=names, next_poses=proposals, next_std=course, poses=model.T_WF)


@documented
def sphere(robot, points, *, groups=None, length_unit="mm", solver=calibrate_sphere_target):
    """Where a scanner sits on the flange, from flange poses and the center of one sphere seen in each.

    Parameters
    ----------
    robot : array-like, shape (N, 4, 4)
    points : array-like, shape (N, 3)
        The centers in the scanner's frame.
    groups : sequence, optional
        As in `hand_eye`.
    length_unit : str
    solver : callable
        Fits a mounting; `fast.hand_eye.calibrate_sphere_target` gives the same and is quick.

    Returns
    -------
    Calibration
        T is the sensor in the flange; `points["center"]` the center in the base.
    """
    model = SphereModel(robot, points, solver=solver)
    advice.refuse_one_axis(model.T_BF)
    solution, kept = majority(model)
    plain = _attempt(lambda: model.fitted(np.ones(model.n, bool)))
    found = _assembled(
        model, solution, kept, plain, groups, length_unit,
        kind="sphere", meaning="sensor in the flange", T=solution[0], points={"center": solution[1]}, frame="flange",
    )  # fmt: skip
    proposals, course = next_poses(model, solution, kept)
    return _with(found, next_poses=proposals, next_std=course, poses=model.T_BF)


@documented
def frame(points, nominal=None, *, std_trans=None, groups=None, length_unit="mm"):
    """A frame from measured points: the best fit to nominal ones, or through three (origin, x axis, xy plane).

    Parameters
    ----------
    points : array-like, shape (N, 3)
    nominal : array-like, shape (N, 3), optional
        Where the same points sit in the frame.
    std_trans : float, optional
        Noise of a coordinate; without it three points alone give no covariance.

    Returns
    -------
    Calibration

    Raises
    ------
    ValueError
        Fewer than three points, points on one line, too few that agree.
    """
    points = as_points(points, "points")
    if nominal is None:
        T, covariance = three_point_frame(as_shape(points, "points (without nominal ones)", 3, 3), std_trans)
        note = () if std_trans else ("three points fit any frame: give --std-trans to learn how well it is known",)
        return Calibration(
            "frame", "frame in the measuring system", length_unit, T,
            np.full((6, 6), np.nan) if covariance is None else covariance,
            np.zeros((3, 3)), np.ones(3, bool), np.zeros(0), {}, None, warnings=note, advice=(),
        )  # fmt: skip
    model = FrameModel(nominal, points, (std_trans,))
    if model.n < 3:
        raise ValueError(f"a frame needs at least 3 points, got {model.n}")
    solution, kept = majority(model)
    plain = _attempt(lambda: model.fitted(np.ones(model.n, bool)))
    return _assembled(
        model, solution, kept, plain, groups, length_unit,
        kind="frame", meaning="frame in the measuring system", T=solution[0], frame="frame",
    )  # fmt: skip


@documented
def compare(time_a, a, time_b, b, *, length_unit="mm", max_offset=None, max_gap=None, solver=calibrate_hand_eye):
    """Two streams of poses of one motion on two clocks: mounting, clock offset, and the error of the second.

    Parameters
    ----------
    time_a, a : array-like, shapes (n,) and (n, 4, 4)
        The reference: the flange in the base, s.
    time_b, b : array-like, shapes (m,) and (m, 4, 4)
        What is judged: the marker in the world of its tracker.
    max_offset : float, optional
        Search for the clock offset within this (s).
    max_gap : float, optional
        Samples of the reference farther apart are not joined (s); 3.5 median steps without it.
    length_unit : str
    solver : callable
        As in `hand_eye`.

    Returns
    -------
    Calibration
        T is the marker in the flange, T_target the tracker's world in the base.

    Raises
    ------
    ValueError
        Streams that hardly overlap, poses that turn about one axis only, too few that agree.
    """
    a, b = as_transforms(a, "a"), as_transforms(b, "b")
    clocks = clock_offset(time_a, a, time_b, b, max_offset)
    when = np.asarray(time_b, float) - clocks.offset
    reference, known = sample_stream(time_a, a, when, longest_step(time_a) if max_gap is None else max_gap)
    if known.sum() < 10:
        raise ValueError(f"only {int(known.sum())} samples of the second stream fall within the first")
    reference, seen, when = reference[known], b[known], when[known]
    rows = np.unique(np.linspace(0, len(seen) - 1, min(FIT_ROWS, len(seen))).astype(int))
    # B = Y^-1 A X is the loop of a sensor that stands still, Y, and reads the marker X on the flange A
    model = HandEyeModel(invert(reference[rows]), seen[rows], solver=solver)
    advice.refuse_one_axis(model.T_BF)
    solution, kept = majority(model)
    advice.refuse_open_loop(model.T_BF[kept], model.linearize(solution)[0][kept], length_unit)
    blocks = np.arange(len(rows)) * BLOCKS // len(rows)
    found = _assembled(
        model, solution, kept, None, blocks, length_unit, kind="compare", meaning="marker in the flange",
        T=solution[1], T_target=solution[0], frame="flange", part=slice(6, 12),
    )  # fmt: skip
    found = _with(_widened_by_blocks(found), group_shifts={})
    predicted = invert(found.T_target) @ reference @ found.T
    angle, distance = pose_distance(predicted, seen)
    step = np.maximum(np.gradient(when), 1e-9)
    speed = np.linalg.norm(np.gradient(reference[:, :3, 3], axis=0), axis=1) / step
    return _with(
        found, time_offset=clocks,
        comparison=Comparison(when, np.rad2deg(angle), distance, speed, _over_speed(angle, distance, speed),
                              int((~known).sum())),
    )  # fmt: skip


def _widened_by_blocks(found):
    """The covariance as far as leaving out blocks of neighbors bears it out: samples of a stream share their errors."""
    shifts = np.array(list(found.group_shifts.values()))
    if not np.isfinite(shifts).all() or len(shifts) < BLOCKS:
        return found
    spread = (len(shifts) - 1) / len(shifts) * shifts.T @ shifts  # the jackknife over blocks
    wider = float(np.trace(np.linalg.solve(found.covariance, spread)) / 6)
    if wider <= SHARED:
        return found
    said = (
        f"neighboring samples share their errors: the standard deviations are {np.sqrt(wider):.1f} times what so many "
        "independent ones would give",
    )
    return _with(found, covariance=wider * found.covariance, warnings=found.warnings + said)


def _over_speed(angle, distance, speed):
    """Rows (from, to, count, rms deg, rms length) over ranges of speed with equal counts."""
    edges = np.unique(np.quantile(speed, np.linspace(0, 1, FASTEST_BINS + 1)))
    table = []
    for k in range(len(edges) - 1):
        inside = (speed >= edges[k]) & ((speed < edges[k + 1]) | (k == len(edges) - 2))
        if inside.any():
            rms = [float(np.sqrt((v[inside] ** 2).mean())) for v in (np.rad2deg(angle), distance)]
            table.append((float(edges[k]), float(edges[k + 1]), int(inside.sum()), *rms))
    return table


# --- what all kinds share --------------------------------------------------------------------------------------------


def _assembled(model, solution, kept, plain, groups, length_unit, kind, meaning, T, frame, T_target=None, points=None,
               part=slice(0, 6)):  # fmt: skip
    r, J, noise = model.whitened(solution, kept)
    scale = np.repeat(noise.std, model.channels)
    residuals = r * scale
    covariance = inverse_normal(model.widened(J[kept], noise))[part, part]
    alone, _ = leave_out(r[kept], J[kept])
    everywhere = residuals.copy()
    everywhere[kept] = alone * scale
    columns = J[kept].reshape(-1, J.shape[2])
    values = np.linalg.svd(columns / np.linalg.norm(columns, axis=0), compute_uv=False)
    labels = None if groups is None else as_shape(groups, "groups", model.n)
    by_group = {} if labels is None else _group_shifts(r[kept], J[kept], labels[kept], part)
    words = ("rotation_rad", "translation") if len(model.channels) == 2 else ("translation",)
    std, freedom = (dict(zip(words, map(float, values))) for values in noise)
    return Calibration(
        kind, meaning, length_unit, T, covariance, residuals, kept, values,
        std, _plain(model, plain), points or {}, POSE, T_target, everywhere, by_group,
        _sentences(kind, covariance, frame), _cautions(kept, noise) + _loose(model, residuals[kept], length_unit),
        noise_freedom=freedom,
    )  # fmt: skip


def _group_shifts(r, J, labels, part):
    """{group: how far the six parameters move without it}."""
    return {float(g): s[part] for g, s in zip(np.unique(labels), leave_out(r, J, labels)[1])}


def _sentences(kind, covariance, frame):
    """What is known worst, and what would help."""
    if kind == "pivot":
        _, sentence = advice.weak_direction(covariance[:3, :3], "tool", "the position of the tip along")
        return (f"{sentence}: tilt the tool about axes across it",) if sentence else ()
    out = []
    own = "frame" if kind == "frame" else "sensor"
    _, turn = advice.weak_direction(covariance[:3, :3], own, "turning about")
    _, shift = advice.weak_direction(covariance[3:, 3:], frame, "the position along")
    if kind == "frame":
        out += [f"{turn}: add points far from that axis"] if turn else []
    else:
        out += [f"{turn}: tilt the flange about axes across it"] if turn else []
        out += [f"{shift}: turn the flange more about axes across it"] if shift else []
    return tuple(out)


def _cautions(kept, noise):
    share, freedom, said = 1 - kept.mean(), noise.freedom.min(), ()
    if share > MANY_REJECTED:
        said += (f"{100 * share:.0f} % of the rows disagree with the others: look at them before you trust the rest",)
    if freedom < 1:
        said += ("so few rows leave nothing to estimate the noise from: no standard deviation can be trusted",)
    elif freedom < FEW_FREEDOM:
        said += (
            f"so few rows leave {freedom:.1f} degrees of freedom for the noise: every standard deviation may be off by "
            f"{100 / np.sqrt(2 * freedom):.0f} %",
        )
    return said


def _loose(model, residuals, length_unit):
    """A warning when even the rows that agree miss by much beside the way the poses cover."""
    if model.way is None:
        return ()
    rms, way = _rms(residuals)[1], np.linalg.norm(np.std(model.way[:, :3, 3], axis=0))
    if rms <= LOOSE * way:
        return ()
    return (
        f"the rows that agree miss by {rms:.3g} {length_unit} (rms), {100 * rms / way:.0f} % of what the poses move: "
        "are format, order of the angles and units right?",
    )


def _moved(model, kept, length_unit):
    """A warning when the rejected rows are one block that fits another mounting: something slipped."""
    if (~kept).sum() < 4:
        return ()
    other = _attempt(lambda: model.fit(~kept))
    if other is None:
        return ()
    _, _, noise = model.whitened(model.fitted(kept), kept)
    again = model.linearize(other)[0][~kept] / np.repeat(noise.std, model.channels)
    block = advice.moved_block(kept, np.median((again**2).sum(1)) < 4 * again.shape[1])
    if block is None:
        return ()
    angle, distance = pose_distance(model.fitted(kept)[0], other[0])
    return (
        f"rows {block[0]} to {block[1]} agree among themselves, but with another mounting, {np.rad2deg(angle):.2g} deg "
        f"and {distance:.3g} {length_unit} away: did something slip before row {block[0]}?",
    )


def _plain(model, solution):
    if solution is None:
        return None
    T = solution[0]
    if T.shape == (3,):
        T = np.eye(4)
        T[:3, 3] = solution[0]
    return Plain(T, *_rms(model.linearize(solution)[0]))


def _attempt(work):
    try:
        return work()
    except ValueError:
        return None


def _rms(residuals):
    """(rms angle in deg or NaN, rms distance) of residuals (n, 6) or (n, 3)."""
    length = float(np.sqrt((residuals[:, -3:] ** 2).sum(1).mean())) if len(residuals) else np.nan
    if residuals.shape[1] < 6:
        return np.nan, length
    return float(np.rad2deg(np.sqrt((residuals[:, :3] ** 2).sum(1).mean()))), length


def _with(result, **changes):
    return Calibration(**{**vars(result), **changes})


def _numbers(values):
    return " ".join(f"{float(v) + 0.0:.5g}" for v in values)


def _escaped(text):
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def _listed(value):
    """Arrays as lists, NaN as None, all the way down."""
    if isinstance(value, dict):
        return {key: _listed(v) for key, v in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [_listed(v) for v in value]
    if isinstance(value, float | np.floating):
        return float(value) if np.isfinite(value) else None
    return int(value) if isinstance(value, np.integer) else value
