"""Finding misprints in tables: which single slip of a typist would explain a reading that does not fit?

A residual says that something is wrong with a row, not what. So every entry of the row is changed by every single slip
(two digits swapped, one wrong, one too many, one missing, the decimal point moved, a sign lost), and the row is
predicted again. A slip that removes the residual in all three axes, where hundreds of others do not, is evidence; the
row's neighbors in the measuring pattern are the second witness.
"""

import functools
from dataclasses import dataclass

import numpy as np

from ..calibration import hand_eye
from ..fast.hand_eye import calibrate_sphere_target
from ..geometry import frames, lie
from .slips import SLIPS, single_slips
from .thesis.printed import CENTER_COLUMNS, POSE_COLUMNS, measurements_from

SUSPICIOUS = 6.0  # residual length in standard deviations of one coordinate: a normal error exceeds it with 1e-7
TURNED = np.deg2rad(0.2)  # a pose farther from the middle of its neighbors breaks the pattern; sound ones stay in 0.11
EXPLAINED = 4.0  # a slip explains a row when what remains is shorter: one sound row in 900 is longer. No digit says it


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
    turn: float = np.nan


@functools.lru_cache(maxsize=1024)
def _slips_and_values(text):
    """The slips of a text as (corrected, slip) pairs, and their values."""
    slips = tuple(single_slips(text).items())
    return slips, np.array([float(corrected) for corrected, _ in slips])


def explanations(entries, pose, T_FS, target, std):
    """Slips of one row that bring its residual below `EXPLAINED` standard deviations, the most credible first.

    First come those that leave the flange turned halfway between its neighbors on the line of motion, then lost signs
    and swapped digits before rarer slips, then the smaller residual.

    Parameters
    ----------
    entries : dict
        {(table, pose, column): text} as `thesis.printed_entries` returns it.
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
    tables = [_slips_and_values(text) for text in texts]
    place = np.repeat(np.arange(len(texts)), [len(values) for _, values in tables])  # the entry each trial changes
    labels = [slip for slips, _ in tables for slip in slips]
    row = np.array(list(map(float, texts)))
    trials = np.tile(row, (len(labels) + 1, 1))  # the last one stays as printed
    trials[np.arange(len(labels)), place] = np.concatenate([values for _, values in tables])
    T_BF = frames.matrix_from_kuka(frames.kuka_from_degrees(trials[:, :6]))
    lengths = np.linalg.norm(hand_eye.sphere_residuals(T_BF, trials[:, 6:], T_FS, target), axis=1)
    halfway = _halfway(measurements_from(entries), pose - 1)
    found = []
    for k in np.flatnonzero(lengths[:-1] <= EXPLAINED * std):
        (corrected, slip), (table, column) = labels[k], columns[place[k]]
        turn = np.nan if halfway is None else float(frames.rotation_angle(halfway.T @ T_BF[k, :3, :3]))
        found.append(Explanation(table, pose, column, texts[place[k]], corrected, slip, lengths[-1], lengths[k], turn))
    return sorted(found, key=lambda e: (e.turn > TURNED, SLIPS.index(e.slip) > 1, e.after))


def find(entries):
    """Suspicious rows and what would explain each, {pose: list of Explanation}, from a robust joint fit.

    The robust fit gives every suspicious row the weight 0, so that the calibration a row is judged by never saw it.
    """
    measured = measurements_from(entries)
    fit = calibrate_sphere_target(measured.T_BF, measured.x_S, robust=True)
    lengths = np.linalg.norm(fit.residuals, axis=1)
    suspects = np.flatnonzero(lengths > SUSPICIOUS * fit.std) + 1
    return {int(i): explanations(entries, int(i), fit.T_FS, fit.target, fit.std) for i in suspects}


def _halfway(measured, i):
    """Orientation halfway between the two neighbors of pose i on its line of motion; None at the ends of a line."""
    if not 0 < i < len(measured.line) - 1 or not measured.line[i - 1] == measured.line[i] == measured.line[i + 1]:
        return None
    before, after = measured.T_BF[[i - 1, i + 1], :3, :3]
    return before @ lie.exp_so3(lie.log_so3(before.T @ after) / 2)


def neighbor_turns(measured):
    """How far each pose is turned away from the middle of its neighbors on the line (rad), NaN at the ends; (31,).

    The pattern turns by equal steps about one axis, so the middle one of three poses should be halfway; no calibration
    enters.
    """
    halfway = [_halfway(measured, i) for i in range(len(measured.line))]
    R = measured.T_BF[:, :3, :3]
    return np.array([np.nan if H is None else frames.rotation_angle(H.T @ R[i]) for i, H in enumerate(halfway)])


def neighbor_offsets(measured):
    """How far each flange stands off the plane its line of motion turns in, against the median of the line (mm), (31,).

    A line of motion turns about one axis, the median of the turns from pose to pose; along it the flange hardly moves.
    """
    T, offsets = measured.T_BF, np.empty(len(measured.line))
    for line in np.unique(measured.line):
        members = np.flatnonzero(measured.line == line)
        steps = lie.log_so3(T[members[1:], :3, :3] @ np.swapaxes(T[members[:-1], :3, :3], 1, 2))
        axis = np.median(steps, axis=0)
        along = T[members, :3, 3] @ (axis / np.linalg.norm(axis))
        offsets[members] = along - np.median(along)
    return offsets
