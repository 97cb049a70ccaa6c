"""What the robot has to do so that a calibration is determined, and the refusal that names what is missing."""

import numpy as np

from ..checks import shown

MIN_TURN = 1e-3  # rad: poses turned by less than this about an axis do not fix what is shifted along the other


def turning(R, weights):
    """How far orientations turn about the axes across each direction, and the directions.

    With dR the deviations from the weighted mean, sum w dR dR' / sum w has the squared turns as eigenvalues, to first
    order; its null vector is the axis that all of them share.

    Parameters
    ----------
    R : array, shape (n, 3, 3)
    weights : array, shape (n,)

    Returns
    -------
    turns : array, shape (3,)
        Root-mean-square turn (rad), smallest first.
    directions : array, shape (3, 3)
        The direction of each, as columns, in the frame that R maps to.
    """
    total = weights.sum()
    D = R - np.tensordot(weights, R, 1) / total
    values, directions = np.linalg.eigh(np.einsum("n,nij,nkj->ik", weights, D, D) / total)
    return np.sqrt(np.maximum(values, 0.0)), directions


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
    turns, directions = turning(R, weights)
    if turns[2] < MIN_TURN:
        raise ValueError(
            f"the poses only translate: {shifted} can be shifted together in any direction; add poses that turn the "
            "flange about two different axes"
        )
    if turns[0] < MIN_TURN:
        axis = directions[:, 0] * np.sign(directions[np.abs(directions[:, 0]).argmax(), 0])
        raise ValueError(
            f"all poses turn about one axis, {shown(axis, '.3f')} in the {frame}: {shifted} can be shifted together "
            "along it; add poses that turn the flange about another axis"
        )
