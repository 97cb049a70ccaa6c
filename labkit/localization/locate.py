"""Where a robot was, from its own log and nothing else: clocks mended, a global start by particles, noise fitted.

`locate` puts the pieces together: one clean clock for rows and readings, particles on the circles that readings put
around their landmarks, standard deviations of greatest likelihood where none are given, the filter of `path`, and a
new start where it has lost the robot.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares, minimize

from ..checks import as_choice, as_instance, as_items, as_names, as_points, as_positive_number, as_shape
from ..documented import documented
from ..estimation.kalman import mean_band
from ..geometry.planar import compose_pose, relative_pose, wrap_angle
from . import odometry, path
from .path import Log, Noise

WINDOW, FEWEST = 30, 4  # readings of a global start, and the fewest that must agree with it
PROPOSERS, PARTICLES = 12, 300  # readings that propose poses, and poses that each proposes
SPURIOUS = 0.1  # share of readings that mean nothing, in the likelihood
WEAK_PRIOR = 25.0  # times the covariance of a global start, whose readings the filter sees again: 4 % counted twice
GUESS = Noise(0.1, 0.05, 0.05, 0.05)  # where nothing is given and nothing is fitted yet
FIT_READINGS = 600
LOST = 12  # rejected readings in a row that name their landmark
RESTARTS = 20
LONGEST_STEP = 10.0  # median steps; a longer one is a jump of the clock, or the log paused
NAMES = ("std_range", "std_bearing", "std_way", "std_turn")
UNITS = ("m", "rad", "m per root s", "rad per root s")


@dataclass(frozen=True, eq=False)
class Located:
    """Where the robot was.

    time (n,): as the odometry had it. x (n, 3): m, m, rad. cov (n, 3, 3). used (k,): which readings, in the order of
    the file. nis (k,): NaN where a reading could not be judged. why (k,): "" or the reason why it was not used. noise:
    `Noise`, and fitted: which of it. restarts: rows where the robot was searched anew. errors (n, 3) and nees (n,):
    against the truth, NaN where there is none.
    """

    time: np.ndarray
    x: np.ndarray
    cov: np.ndarray
    used: np.ndarray
    nis: np.ndarray
    why: tuple
    noise: Noise
    fitted: tuple
    restarts: tuple
    warnings: tuple
    errors: np.ndarray | None = None
    nees: np.ndarray | None = None

    @property
    def mean_nis(self):
        """Mean NIS of the readings used; 2 when the noise is right, 1.99 behind the gate."""
        return float(self.nis[self.used].mean()) if self.used.any() else np.nan

    def as_dict(self):
        """The summary that result.json holds."""
        low, high = mean_band(2, max(int(self.used.sum()), 1))
        found = {
            "kind": "localize",
            "rows": len(self.x),
            "readings": len(self.used),
            "rejected": [{"reading": int(k) + 1, "why": self.why[k]} for k in np.flatnonzero(~self.used)],
            "mean_nis": self.mean_nis if self.used.any() else None,
            "mean_nis_band": [float(low), float(high)],
            "noise": {name: getattr(self.noise, name) for name in NAMES},
            "noise_units": dict(zip(NAMES, UNITS)),
            "fitted": list(self.fitted),
            "restarts": [int(r) + 1 for r in self.restarts],
            "warnings": list(self.warnings),
        }
        if self.nees is not None:
            known = np.isfinite(self.nees)
            found["mean_nees"] = float(self.nees[known].mean())
            found["rms_position"] = float(np.sqrt((self.errors[known, :2] ** 2).sum(1).mean()))
            found["rms_heading_deg"] = float(np.rad2deg(np.sqrt((self.errors[known, 2] ** 2).mean())))
        return found

    def lines(self):
        """The result in a few lines of text."""
        about = self.as_dict()
        out = [
            f"{about['rows']} poses from {about['readings']} readings, {int(self.used.sum())} of them used",
            "noise: " + ", ".join(
                f"{name} {getattr(self.noise, name):.3g} {unit}{' (fitted)' if name in self.fitted else ''}"
                for name, unit in zip(NAMES, UNITS)
            ),
            f"mean NIS {self.mean_nis:.3f} (2 is honest)",
        ]  # fmt: skip
        reasons = sorted(set(self.why) - {""})
        out += [f"not used, {reason}: {sum(w == reason for w in self.why)}" for reason in reasons]
        if self.nees is not None:
            out.append(
                f"against the truth: {about['rms_position']:.4g} m and {about['rms_heading_deg']:.4g} deg (rms), "
                f"mean NEES {about['mean_nees']:.3f} (3 is honest)"
            )
        return out + [f"warning: {w}" for w in self.warnings]

    def __repr__(self):
        return "\n".join(self.lines())

    def _repr_html_(self):
        return "<ul>" + "".join(f"<li>{line.replace('<', '&lt;')}</li>" for line in self.lines()) + "</ul>"


# --- one clean clock -------------------------------------------------------------------------------------------------


def mend_clock(time):
    """A clock that only rises, from one that was set: (time, starts of its parts, warnings).

    A step backward, or one longer than ten median steps, is replaced by a median one and begins a new part.
    """
    time = as_shape(time, "time", "n")
    step = np.diff(time)
    usual = float(np.median(step[step > 0])) if (step > 0).any() else 0.0
    if not usual > 0:
        raise ValueError("the time of the odometry never increases")
    jumps = (step < 0) | (step > max(LONGEST_STEP * usual, 0.5))
    clean = np.concatenate([[0.0], np.cumsum(np.where(jumps, usual, step))])
    starts = np.concatenate([[0], np.flatnonzero(jumps) + 1])
    said = tuple(
        f"the clock of the odometry jumps by {step[k - 1]:+.4g} s before row {k + 1}; a step of {usual:.3g} s was taken"
        for k in starts[1:6]
    )
    return clean, starts, said + ((f"and {len(starts) - 6} jumps more",) if len(starts) > 6 else ())


@documented
def place_readings(odometry_time, starts, reading_time):
    """The odometry row in which each reading was taken.

    Where a clock was set back, times come twice: readings in the order of their file stay in one part of the odometry
    until their own time falls back or leaves it.

    Parameters
    ----------
    odometry_time : array, shape (n,), s
        n >= 2.
    starts : array of int, shape (k,)
        Rows in which a part of the odometry with rising times begins.
    reading_time : array, shape (m,), s

    Returns
    -------
    row : array of int, shape (m,)
        -1 where the odometry does not cover the reading.
    lag : array, shape (m,), s
        Since the time of that row.

    Raises
    ------
    ValueError
        Parts that do not begin at row 0, or do not rise; fewer than two rows.
    """
    if len(odometry_time) < 2:
        raise ValueError(f"odometry_time must hold at least 2 times, got {len(odometry_time)}")
    if not len(starts) or starts[0] != 0 or (np.diff([*starts, len(odometry_time)]) <= 0).any():
        raise ValueError("starts must rise from 0 and stay below the number of rows")
    ends = np.concatenate([starts[1:], [len(odometry_time)]])
    usual = float(np.median(np.abs(np.diff(odometry_time))))
    low, high = odometry_time[starts], odometry_time[ends - 1] + usual
    row, lag, part, last = np.full(len(reading_time), -1), np.zeros(len(reading_time)), 0, -np.inf
    for i, t in enumerate(reading_time):
        fell = t < last - usual
        later = [p for p in range(part + fell, len(starts)) if low[p] <= t < high[p]]
        if not later:
            later = [p for p in range(part, -1, -1) if low[p] <= t < high[p]]
        last = t
        if later:
            part = max(part, later[0])
            k = (
                starts[later[0]]
                + np.searchsorted(odometry_time[starts[later[0]] : ends[later[0]]], t, side="right")
                - 1
            )
            row[i], lag[i] = k, t - odometry_time[k]
    return row, lag


# --- a global start --------------------------------------------------------------------------------------------------


@documented
def global_start(log, noise, rng):
    """Pose and covariance at the first row of a log, from its first readings alone: particles, then least squares.

    Each reading puts the robot on a circle around the landmark it names (around all of them when it names none). The
    particles there are carried back to the first row, judged by all readings of the window with a likelihood that
    forgives spurious ones, and the best is refined.

    Parameters
    ----------
    log : Log
    noise : Noise
    rng : numpy.random.Generator

    Returns
    -------
    x0, cov0 : arrays, shapes (3,) and (3, 3)
        m, m, rad.

    Raises
    ------
    ValueError
        When too few readings agree with any pose.
    """
    z, landmark = log.z[:WINDOW], log.landmark[:WINDOW]
    if len(z) < FEWEST:
        raise ValueError(f"a global start needs at least {FEWEST} readings, got {len(z)}")
    way = _ways(log, len(z))
    std = np.array([3 * noise.std_range, 3 * noise.std_bearing])
    coarse = np.sqrt(std**2 + np.array([0.2, 0.1]) ** 2)
    particles = np.concatenate([_around(log, j, way[j], rng) for j in range(min(PROPOSERS, len(z)))])
    score = np.zeros(len(particles))
    for j in range(len(z)):
        score += np.log(np.exp(-0.5 * _misfits(particles, way[j], z[j], landmark[j], log.landmarks, coarse)) + 0.01)
    best = particles[np.argmax(score)]

    def normalized(x):
        return np.concatenate([_difference(x, way[j], z[j], landmark[j], log.landmarks, std) for j in range(len(z))])

    found = least_squares(normalized, best, loss="cauchy", x_scale=[1.0, 1.0, 0.3])
    close = (normalized(found.x).reshape(-1, 2) ** 2).sum(1) < path.LIMIT
    if close.sum() < max(FEWEST, 0.4 * len(z)):
        raise ValueError(
            f"no pose explains the readings: the best one fits {int(close.sum())} of the first {len(z)}. "
            "Are map, ids and units right?"
        )
    J = found.jac.reshape(len(z), 2, 3)[close].reshape(-1, 3)
    cov = WEAK_PRIOR * np.linalg.pinv(J.T @ J)
    return found.x, 0.5 * (cov + cov.T)


def _ways(log, count):
    """Where dead reckoning has carried the robot at each of the first readings, seen from the first row, (count, 3)."""
    at = log.row[:count]
    rows = _reckoned(log, int(at[-1]) + 1)
    return odometry.step(rows[at], log.u[at], np.maximum(log.lag[:count], 1e-12), "midpoint")


def _reckoned(log, count):
    """Poses at the first rows by dead reckoning (midpoint), seen from the first, (count, 3)."""
    dt, u = np.diff(log.time[:count]), log.u[: count - 1]
    heading = np.concatenate([[0.0], np.cumsum(dt * u[:, 1])])
    middle = heading[:-1] + 0.5 * dt * u[:, 1]
    steps = (dt * u[:, 0])[:, None] * np.stack([np.cos(middle), np.sin(middle)], 1)
    return np.column_stack([np.concatenate([np.zeros((1, 2)), np.cumsum(steps, 0)]), heading])


def _around(log, j, way, rng):
    """Poses at the first row from which reading j would be seen as it was."""
    r, bearing = log.z[j]
    marks = log.landmarks if log.landmark[j] < 0 else log.landmarks[log.landmark[j]][None]
    angle = rng.uniform(-np.pi, np.pi, (len(marks), PARTICLES))
    x = marks[:, :1] + r * np.cos(angle)
    y = marks[:, 1:] + r * np.sin(angle)
    there = np.stack([x, y, angle + np.pi - bearing], -1).reshape(-1, 3)
    return compose_pose(there, relative_pose(way, np.zeros(3)))


def _difference(x, way, z, landmark, landmarks, std):
    """Normalized difference of a reading to the landmark it saw, or to the nearest, (..., 2)."""
    at = compose_pose(x, way)
    marks = landmarks if landmark < 0 else landmarks[landmark][None]
    d = z - path.measurement(at, marks)
    d[..., 1] = wrap_angle(d[..., 1])
    d = d / std
    nearest = (d**2).sum(-1).argmin(-1)
    return np.take_along_axis(d, nearest[..., None, None], axis=-2)[..., 0, :]


def _misfits(particles, way, z, landmark, landmarks, std):
    return (_difference(particles, way, z, landmark, landmarks, std) ** 2).sum(-1)


# --- noise -----------------------------------------------------------------------------------------------------------


@documented
def fit_noise(log, x0, cov0, noise, free, filter_path):
    """Standard deviations of greatest likelihood, from the first readings of a log.

    The likelihood of a reading is that of its innovation, mixed with a tenth that means nothing: spurious readings cost
    the same whatever the noise.

    Parameters
    ----------
    log : Log
    x0, cov0 : arrays, shapes (3,) and (3, 3)
        What is known of the start (m, m, rad).
    noise : Noise
        Where to begin, and what is not free.
    free : tuple of str
        The names of those to find.
    filter_path : callable
        Of `localization.path` or `fast.path`.

    Returns
    -------
    Noise
    """
    for name in free:
        as_choice(name, "free", NAMES)
    log = log.readings(np.arange(len(log.z)) < FIT_READINGS)
    log = log.rows(0, int(log.row[-1]) + 1)
    nothing = SPURIOUS / (2 * np.pi * max(log.z[:, 0].max(), 1.0))

    def cost(logs):
        trial = replace(noise, **dict(zip(free, np.exp(np.clip(logs, -12, 4)))))
        seen = as_instance(filter_path(log, x0, cov0, trial), "what filter_path returns", path.Path)
        density = np.exp(np.clip(-0.5 * (seen.nis + seen.log_det), -700, 50)) / (2 * np.pi)
        return -float(np.log((1 - SPURIOUS) * density + nothing).sum()) + 0.01 * float(np.sum((logs - start) ** 2))

    start = np.log([getattr(noise, name) for name in free])
    simplex = np.vstack([start, start + 0.7 * np.eye(len(free))])
    options = {"initial_simplex": simplex, "xatol": 0.02, "fatol": 0.05, "maxfev": 40 * len(free)}
    best = minimize(cost, start, method="Nelder-Mead", options=options)
    return replace(noise, **dict(zip(free, np.exp(best.x))))


# --- the whole -------------------------------------------------------------------------------------------------------


@documented
def locate(
    odometry_time, u, reading_time, ids, z, landmark_ids, landmarks, *, noise=None, truth=None, seed=0,
    filter_path=path.filter_path,
):  # fmt: skip
    """The path of a robot with its covariance, from odometry, a map, and ranges and bearings.

    Parameters
    ----------
    odometry_time, u : array-like, shapes (n,) and (n, 2)
        s, and v (m/s) and omega (rad/s) held until the next row. The clock may jump.
    reading_time, ids, z : shapes (k,), (k,) and (k, 2)
        s, the landmark named (None where unknown), range (m) and bearing (rad).
    landmark_ids, landmarks : (m,) and array-like (m, 2)
        The map.
    noise : dict, optional
        Standard deviations by name (`Noise`); those missing are fitted.
    truth : pair of arrays, optional
        Times (q,) on the clock of the odometry and poses (q, 3).
    seed : int
        Of the particles, at least 0.
    filter_path : callable
        The filter; `fast.path.filter_path` gives the same and is quick.

    Returns
    -------
    Located

    Raises
    ------
    ValueError
        One sentence: nothing explains the readings, or none can be placed.
    """
    truth = None if truth is None else _as_true_path(truth)
    u, z, landmarks = as_points(u, "u", 2), as_shape(z, "z", "k", 2), as_shape(landmarks, "landmarks", "m", 2)
    raw_time = as_shape(odometry_time, "odometry_time", len(u))
    reading_time = as_shape(reading_time, "reading_time", len(z))
    ids, landmark_ids = as_names(ids, "ids"), as_names(landmark_ids, "landmark_ids")
    for name, named, rows in (("ids", ids, z), ("landmark_ids", landmark_ids, landmarks)):
        if len(named) != len(rows):
            raise ValueError(f"{name} must hold {len(rows)} names, got {len(named)}")
    time, starts, warnings = mend_clock(raw_time)
    row, lag = place_readings(raw_time, starts, reading_time)
    index = {name: k for k, name in enumerate(landmark_ids)}
    landmark = np.array([-1 if name is None else index.get(name, -2) for name in ids], int)
    why = np.array(["" for _ in ids], dtype=object)
    why[landmark == -2] = "its id is not in the map"
    why[row < 0] = "no odometry at its time"
    good = np.flatnonzero(why == "")
    good = good[np.lexsort((lag[good], row[good]))]
    if len(good) < FEWEST:
        raise ValueError(f"only {len(good)} readings name a landmark of the map at a time that the odometry covers")
    log = Log(time, u, z[good], row[good], lag[good], landmark[good], landmarks)
    given = {as_choice(name, "noise", NAMES): as_positive_number(std, name) for name, std in (noise or {}).items()}
    level, rng = replace(GUESS, **given), np.random.default_rng(seed)
    x0, cov0, first = _first_start(log, level, rng)
    free = tuple(name for name in NAMES if name not in given)
    if free:
        level = fit_noise(log.rows(first, len(time) - 1), x0, cov0, level, free, filter_path)
    found, restarts, said = _with_restarts(log, x0, cov0, first, level, rng, filter_path)
    used, nis = np.zeros(len(z), bool), np.full(len(z), np.nan)
    used[good], nis[good] = found.used, found.nis
    why[good[~found.used]] = "it fits no landmark, or two" if (landmark[good] < 0).all() else "beyond the gate"
    errors, nees = _against(raw_time, starts, found, truth) if truth is not None else (None, None)
    return Located(
        raw_time, found.x, found.cov, used, nis, tuple(why), level, free, restarts, (*warnings, *said), errors, nees
    )


def _as_true_path(truth):
    """Times (q,) and poses (q, 3) of the truth; anything else is refused."""
    parts = as_items(truth, "truth", "times and poses")
    if len(parts) != 2:
        raise ValueError(f"truth must hold times and poses, got {len(parts)} parts")
    time = as_shape(parts[0], "the times of truth", "q")
    if not len(time):
        raise ValueError("truth must hold at least one pose, got none")
    return time, as_shape(parts[1], "the poses of truth", len(time), 3)


def _first_start(log, noise, rng):
    """(pose, covariance, row) of the first place where the readings agree on one; earlier readings are passed over."""
    for skip in range(0, max(len(log.z) - FEWEST, 1), WINDOW // 2):
        first = int(log.row[skip]) if skip else 0
        try:
            return (*global_start(log.rows(first, len(log.time) - 1), noise, rng), first)
        except ValueError:
            if skip >= 6 * WINDOW or skip + WINDOW // 2 >= len(log.z) - FEWEST:
                raise
    raise ValueError("no pose explains the readings")


def _with_restarts(log, x0, cov0, first, noise, rng, filter_path):
    """The filter from `first` on, begun anew where it has lost the robot; rows before are carried back by odometry."""
    n = len(log.time)
    x, cov = np.zeros((n, 3)), np.zeros((n, 3, 3))
    nis, log_det = np.full(len(log.z), np.nan), np.zeros(len(log.z))
    used, landmark = np.zeros(len(log.z), bool), log.landmark.copy()
    restarts, said, start = [], [], first
    while True:
        inside = (log.row >= start) & (log.row < n)
        part = filter_path(_tail(log, start), x0, cov0, noise)
        x[start:], cov[start:] = part.x, part.cov
        nis[inside], log_det[inside], used[inside], landmark[inside] = part.nis, part.log_det, part.used, part.landmark
        lost = _lost(part.used, log.landmark[inside], int(start in restarts) * WINDOW)
        if lost is None or len(restarts) >= RESTARTS:
            break
        at = np.flatnonzero(inside)[lost]
        try:
            x0, cov0 = global_start(_tail(log, int(log.row[at])), noise, rng)
        except ValueError:
            said.append(f"the filter loses the robot at row {int(log.row[at]) + 1}, and no pose explains what follows")
            break
        start = int(log.row[at])
        restarts.append(start)
        said.append(f"the robot was lost and found again at row {start + 1}: was it carried, or did the log pause?")
    if first:
        way = _reckoned(log, first + 1)
        x[:first] = compose_pose(x[first], relative_pose(way[-1], way[:-1]))
        cov[:first] = cov[first] + np.diag([1.0, 1.0, 0.1])
        said.append(f"the first {first} rows have no readings that agree: they are dead reckoning, backwards")
    return path.Path(x, cov, nis, log_det, used, landmark), tuple(restarts), tuple(said)


def _tail(log, start):
    """The log from a row on, its last row included."""
    part = log.rows(start, len(log.time) - 1)
    rest = log.readings(log.row >= start)
    return replace(part, z=rest.z, row=rest.row - start, lag=rest.lag, landmark=rest.landmark)


def _lost(used, landmark, patience):
    """Index of the first of twelve rejected readings in a row that name their landmark, or None."""
    streak = 0
    for k in np.flatnonzero(landmark >= 0):
        streak = 0 if used[k] else streak + 1
        if streak >= LOST and k >= patience:
            return int(k) - LOST + 1 if k >= LOST - 1 else 0
    return None


def _against(time, starts, found, truth):
    """Errors (n, 3) and NEES (n,) against true poses, interpolated; NaN where the truth or one clock does not reach."""
    t, x = truth
    level = np.stack([np.interp(time, t, column) for column in (x[:, 0], x[:, 1], np.unwrap(x[:, 2]))], 1)
    e = found.x - level
    e[:, 2] = wrap_angle(e[:, 2])
    nees = np.einsum("ni,ni->n", e, np.linalg.solve(found.cov + 1e-15 * np.eye(3), e[..., None])[..., 0])
    outside = (time < t[0]) | (time > t[-1])
    outside[starts[1] if len(starts) > 1 else len(time) :] = (
        True  # on a clock that was set, only its first part is sure
    )
    e[outside], nees[outside] = np.nan, np.nan
    return e, nees
