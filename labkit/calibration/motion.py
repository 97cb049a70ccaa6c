"""Motions of robot and sensor: what no mounting can change of them, and what they must do so that a calibration is
determined.

A X = X B makes B the same screw as A, seen from elsewhere: both turn by the same angle and shift by the same length
along their axes. Source: Chen, "A screw motion approach to uniqueness analysis of head-eye geometry", CVPR 1991.
"""

import numpy as np

from ..checks import as_count, as_row_weights, as_shape, as_transforms, shown
from ..documented import documented, unchecked
from ..geometry.frames import invert
from ..geometry.lie import log_so3

MIN_TURN = 1e-3  # rad: poses turned by less than this about an axis do not fix what is shifted along the other


def motions(T_BF, T_ST):
    """Motions of flange and sensor from each row to the next, A X = X B with X = T_FS.

    Parameters
    ----------
    T_BF : array-like, shape (n, 4, 4)
        Flange in base.
    T_ST : array-like, shape (n, 4, 4)
        Target in sensor.

    Returns
    -------
    A, B : arrays, shape (n - 1, 4, 4)

    Raises
    ------
    ValueError
        Fewer than two rows, or not as many of both.
    """
    T_BF, T_ST = as_transforms(T_BF, "T_BF"), as_transforms(T_ST, "T_ST")
    if T_BF.ndim != 3 or T_BF.shape != T_ST.shape or len(T_BF) < 2:
        raise ValueError(f"T_BF and T_ST must have shape (n, 4, 4), n at least 2, got {T_BF.shape} and {T_ST.shape}")
    return invert(T_BF[:-1]) @ T_BF[1:], T_ST[:-1] @ invert(T_ST[1:])


def screw(T):
    """Angle of a motion and its shift along the axis: the same for A and B whatever the mounting.

    Parameters
    ----------
    T : array-like, shape (..., 4, 4)

    Returns
    -------
    angle : array, shape (...)
        Between 0 and pi (rad).
    shift : array, shape (...)
        In the unit of the positions, along the axis about which the angle is positive; where nothing turns, the length
        of the translation.
    """
    T = as_transforms(T, "T")
    phi, t = log_so3(T[..., :3, :3]), T[..., :3, 3]
    angle = np.linalg.norm(phi, axis=-1)
    turns = angle > 0
    along = (phi * t).sum(-1) / np.where(turns, angle, 1.0)
    return angle, np.where(turns, along, np.linalg.norm(t, axis=-1))


def between_axes(T, apart=1):
    """Angles between the axes of motions: the same for A and B whatever the mounting.

    Motions that share a row keep this angle even where one file holds the inverse poses; two apart they do not.

    Parameters
    ----------
    T : array-like, shape (n, 4, 4)
        Motions that turn.
    apart : int
        Each is compared with the one so many further on.

    Returns
    -------
    angles : array, shape (n - apart,)
        Between 0 and pi (rad).

    Raises
    ------
    ValueError
        No motion that is so many further on.
    """
    T, apart = as_shape(as_transforms(T, "T"), "T", "n", 4, 4), as_count(apart, "apart")
    phi = log_so3(T[:, :3, :3])
    if apart >= len(T):
        raise ValueError(f"apart must be below the number of motions, {len(T)}, got {apart}")
    axes = phi / np.linalg.norm(phi, axis=1, keepdims=True)
    return np.arccos(np.clip((axes[apart:] * axes[:-apart]).sum(1), -1, 1))


@documented
def turning(R, weights):
    """How far orientations turn about the axes across each direction, and the directions.

    With dR the deviations from the weighted mean, sum w dR dR' / sum w has the squared turns as eigenvalues, to first
    order; its null vector is the axis that all of them share.

    Parameters
    ----------
    R : array, shape (n, 3, 3)
    weights : array, shape (n,)
        At least 0, not all 0.

    Returns
    -------
    turns : array, shape (3,)
        Root-mean-square turn (rad), smallest first.
    directions : array, shape (3, 3)
        The direction of each, as columns, in the frame that R maps to.
    """
    total = as_row_weights(weights).sum()
    D = R - np.tensordot(weights, R, 1) / total
    values, directions = np.linalg.eigh(np.einsum("n,nij,nkj->ik", weights, D, D) / total)
    return np.sqrt(np.maximum(values, 0.0)), directions


@documented
def refuse_one_axis(R, weights, frame, shifted):
    """Refuses orientations that do not turn about two axes.

    Parameters
    ----------
    R : array, shape (n, 3, 3)
        Orientations of the robot.
    weights : array, shape (n,)
    frame : str
        The frame that R maps to, for the sentence: "base" or "flange".
    shifted : str
        What then stays free, for the sentence.

    Raises
    ------
    ValueError
        With the axis that all poses share.
    """
    turns, directions = unchecked(turning)(R, weights)
    if turns[2] < MIN_TURN:
        raise ValueError(
            f"the poses only translate: {shifted} can be shifted together in any direction; add poses that turn the "
            "flange about two different axes"
        )
    if turns[0] < MIN_TURN:
        axis = directions[:, 0]
        axis = axis if axis[np.abs(axis).argmax()] > 0 else -axis
        raise ValueError(
            f"all poses turn about one axis, {shown(axis, '.3f')} in the {frame}: {shifted} can be shifted together "
            "along it; add poses that turn the flange about another axis"
        )
