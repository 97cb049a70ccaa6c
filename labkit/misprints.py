"""Finding misprints in tables: which single slip of a typist would explain a reading that does not fit?

A residual says that something is wrong with a row, not what. So every entry of the row is changed by every single slip
(two digits swapped, one wrong, one too many, one missing, the decimal point moved, a sign lost), and the row is
predicted again. A slip that removes the residual in all three axes, where hundreds of others do not, is evidence; the
row's neighbors in the measuring pattern are the second witness.
"""

from dataclasses import dataclass

import numpy as np

from . import frames, handeye, lie
from .handeye_data import CENTER_COLUMNS, POSE_COLUMNS

SLIPS = (
    "sign lost",
    "two digits swapped",
    "one digit wrong",
    "one digit too many",
    "one digit missing",
    "decimal point moved",
)
SUSPICIOUS = 6.0  # residual length in standard deviations of one coordinate: a normal error exceeds it with 1e-7
EXPLAINED = 4.0  # a slip explains a row when what remains is shorter than this


@dataclass(frozen=True)
class Explanation:
    """One slip that would explain a row: table, pose (from 1), column, printed and corrected text, slip, residual
    before and after (mm).
    """

    table: str
    pose: int
    column: str
    printed: str
    corrected: str
    slip: str
    before: float
    after: float


def single_slips(text):
    """All numbers one slip away from a printed one: {corrected text: slip}, the rarer slips giving way to the commoner.

    >>> single_slips("12")["21"]
    'two digits swapped'
    """
    sign, body = ("-", text[1:]) if text.startswith("-") else ("", text)
    if not body.replace(".", "", 1).isdigit():
        raise ValueError(f"text must be a plain decimal number, got {text!r}")
    found = {}

    def add(candidate, slip, new_sign=sign):
        if candidate.replace(".", "", 1).isdigit() and not (
            len(candidate) > 1 and candidate[0] == "0" and candidate[1] != "."
        ):
            found.setdefault(new_sign + candidate, slip)

    add(body, SLIPS[0], "" if sign else "-")
    places = [i for i, c in enumerate(body) if c != "."]
    for i, j in zip(places, places[1:]):
        swapped = list(body)
        swapped[i], swapped[j] = body[j], body[i]
        add("".join(swapped), SLIPS[1])
    for i in places:
        for digit in "0123456789":
            add(body[:i] + digit + body[i + 1 :], SLIPS[2])
    for i in places:
        add(body[:i] + body[i + 1 :], SLIPS[3])
    for i in range(len(body) + 1):
        for digit in "0123456789":
            add(body[:i] + digit + body[i:], SLIPS[4])
    digits = body.replace(".", "")
    for i in range(len(digits)):
        add((digits[:i] or "0") + "." + digits[i:], SLIPS[5])
    found.pop(text, None)
    return found


def explanations(entries, pose, T_FS, target, std):
    """Slips of one row that bring its residual below `EXPLAINED` standard deviations, best first.

    Parameters
    ----------
    entries : dict
        {(table, pose, column): text} as `handeye_data.printed_entries` returns it.
    pose : int
        Number of the row, from 1.
    T_FS, target : array, shape (4, 4) and (3,)
        A calibration in which this row had no say.
    std : float
        Noise of one coordinate (mm).

    Returns
    -------
    list of Explanation
    """
    columns = [("C14", c) for c in POSE_COLUMNS] + [("C17", c) for c in CENTER_COLUMNS]
    texts = [entries[table, pose, column] for table, column in columns]
    row = np.array(list(map(float, texts)))
    trials, labels = [row], [None]
    for k, text in enumerate(texts):
        for corrected, slip in single_slips(text).items():
            trial = row.copy()
            trial[k] = float(corrected)
            trials.append(trial)
            labels.append((*columns[k], text, corrected, slip))
    trials = np.array(trials)
    T_BF = frames.matrix_from_kuka(frames.kuka_from_degrees(trials[:, :6]))
    lengths = np.linalg.norm(handeye.sphere_residuals(T_BF, trials[:, 6:], T_FS, target), axis=1)
    found = [
        Explanation(table, pose, column, printed, corrected, slip, lengths[0], lengths[k])
        for k, (table, column, printed, corrected, slip) in ((k, labels[k]) for k in np.argsort(lengths) if labels[k])
        if lengths[k] <= EXPLAINED * std
    ]
    return sorted(found, key=lambda e: (SLIPS.index(e.slip) > 1, e.after))


def find(entries, n=31):
    """Suspicious rows and what would explain each: {pose: list of Explanation}, from a robust joint fit of scanner pose
    and sphere center.

    The robust fit gives every suspicious row the weight 0, so that the calibration a row is judged by never saw it.
    """
    columns = [
        [float(entries[t, i, c]) for t, cs in (("C14", POSE_COLUMNS), ("C17", CENTER_COLUMNS)) for c in cs]
        for i in range(1, n + 1)
    ]
    rows = np.array(columns)
    T_BF = frames.matrix_from_kuka(frames.kuka_from_degrees(rows[:, :6]))
    fit = handeye.calibrate_sphere_target(T_BF, rows[:, 6:], robust=True)
    lengths = np.linalg.norm(fit.residuals, axis=1)
    suspects = np.flatnonzero(lengths > SUSPICIOUS * fit.std) + 1
    return {int(i): explanations(entries, int(i), fit.T_FS, fit.target, fit.std) for i in suspects}


def neighbor_turns(measured):
    """How far each pose is turned away from the middle of its two neighbors on the same line of motion (rad), NaN at
    the ends.

    The pattern turns by equal steps about one axis, so the middle one of three poses should be halfway; no calibration
    enters.
    """
    R, turns = measured.T_BF[:, :3, :3], np.full(len(measured.line), np.nan)
    for i in range(1, len(R) - 1):
        if measured.line[i - 1] == measured.line[i] == measured.line[i + 1]:
            step = lie.log_so3(R[i - 1].T @ R[i + 1])
            turns[i] = frames.rotation_angle((R[i - 1] @ lie.exp_so3(step / 2)).T @ R[i])
    return turns


def neighbor_offsets(measured):
    """How far each flange stands off the plane its line of motion turns in, against the median of the line (mm), (31,).

    A line of motion turns about one axis, here the direction about which its first pose turns into its last; along it
    the flange hardly moves.
    """
    T, offsets = measured.T_BF, np.empty(len(measured.line))
    for line in np.unique(measured.line):
        members = np.flatnonzero(measured.line == line)
        steps = lie.log_so3(T[members[1:], :3, :3] @ np.swapaxes(T[members[:-1], :3, :3], 1, 2))
        axis = np.median(steps, axis=0)
        along = T[members, :3, 3] @ (axis / np.linalg.norm(axis))
        offsets[members] = along - np.median(along)
    return offsets
