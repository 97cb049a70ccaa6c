"""What a calibration leaves unknown, in words, and what went wrong with the roles of its files."""

import numpy as np

from ..checks import as_shape, as_transforms
from ..documented import documented
from ..geometry.frames import invert
from ..geometry.lie import log_so3
from .own_data import HandEyeModel

WORSE = 2.0  # times: a direction this much less certain than the best is worth a sentence
LEAST_TURN = np.deg2rad(1.0)  # rms turn about the second axis of the motions; less is one axis
CLEARLY = 10.0  # times better, in angle or distance, that another role must fit, and worse in neither
OPEN = 0.3  # of the turn about the second axis: residuals as large are no noise
AXES = "xyz"
MIXED_UP = (  # a loop whose robot is inverted closes as well as one whose sensor is: nothing tells them apart
    "it seems that the sensor file holds the sensor in the target, not the target in the sensor "
    "(or the robot file the base in the flange, or {other} was meant): so taken, the loop closes {times} times better"
)


@documented
def axis_name(v, frame):
    """A direction in words: `the flange's z axis`, or its three numbers where it is none.

    Parameters
    ----------
    v : array, shape (3,)
        Of length 1; its sign does not matter.
    frame : str
        Whose axes they are.

    Returns
    -------
    words : str
    """
    v = as_shape(v, "v", 3)
    k = int(np.argmax(np.abs(v)))
    v = v if v[k] > 0 else -v
    if v[k] > 0.94:  # within 20 deg
        return f"the {frame}'s {AXES[k]} axis"
    return f"the direction ({', '.join(f'{x + 0.0:.2f}' for x in v)}) of the {frame}"


@documented
def weak_direction(covariance, frame, what):
    """How unevenly a block of a covariance is determined, and a sentence about it.

    Parameters
    ----------
    covariance : array, shape (3, 3)
    frame : str
        Whose axes they are.
    what : str
        "turning about" or "the position along".

    Returns
    -------
    ratio : float
        Largest standard deviation over the smallest.
    sentence : str or None
        None where they hardly differ.
    """
    values, vectors = np.linalg.eigh(covariance)
    if not values[-1] > 0:
        return 1.0, None
    ratio = float(np.sqrt(values[-1] / max(values[0], 1e-300)))
    worst, best = (axis_name(vectors[:, k], frame) for k in (2, 0))
    if ratio < WORSE:
        return ratio, None
    times = f"{ratio:.0f}" if ratio >= 10 else f"{ratio:.1f}"
    return ratio, f"{what} {worst} is known {times} times worse than {'about' if 'about' in what else 'along'} {best}"


def axis_spread(T):
    """Rms turn of poses about each principal axis of their motions, largest first (rad), and these axes as columns."""
    T = as_shape(as_transforms(T, "T"), "T", "n", 4, 4)
    if not len(T):
        raise ValueError("T must hold at least one pose, got none")
    middle = T[len(T) // 2, :3, :3]
    turns = log_so3(middle.T @ T[:, :3, :3])
    values, vectors = np.linalg.eigh(turns.T @ turns / len(T))
    return np.sqrt(np.maximum(values[::-1], 0.0)), vectors[:, ::-1]


@documented
def refuse_one_axis(T, name="the flange"):
    """Refuse poses that turn about one axis only, or not at all: they leave a direction free.

    Parameters
    ----------
    T : array-like, shape (n, 4, 4)
    name : str
        What turns, for the sentence.
    """
    spread, axes = axis_spread(T)
    if spread[0] < LEAST_TURN:
        raise ValueError(
            f"{name} does not turn, by {round(np.rad2deg(spread[0]), 3):.2g} deg (rms): nothing can be calibrated"
        )
    if spread[1] < LEAST_TURN:
        along, across = np.rad2deg(spread[0]), round(np.rad2deg(spread[1]), 3)
        raise ValueError(
            f"{name} turns about one axis only, {axis_name(axes[:, 0], 'flange')}, by {along:.3g} deg, and by "
            f"{across:.2g} deg across it: one direction stays free, tilt it about a second axis"
        )


@documented
def refuse_mixed_roles(model, eye_to_hand):
    """Refuse poses whose inverses close the loop far better: a file that holds something else.

    Parameters
    ----------
    model : HandEyeModel
    eye_to_hand : bool
    """
    angle, distance = HandEyeModel(model.T_BF, invert(model.T_ST)).misfit
    ratios = model.misfit[0] / (angle + 1e-12), model.misfit[1] / (distance + 1e-12)
    if max(ratios) > CLEARLY and min(ratios) > 0.5:
        other = "no --eye-to-hand" if eye_to_hand else "--eye-to-hand"
        times = f"{max(ratios):.0f}" if max(ratios) < 1000 else "over 1000"
        raise ValueError(MIXED_UP.format(other=other, times=times))


@documented
def refuse_open_loop(T, residuals, length_unit="mm"):
    """Refuse residuals as large as the turns of the poses: nothing closes, so nothing is calibrated.

    Parameters
    ----------
    T : array, shape (n, 4, 4)
    residuals : array, shape (n, 6)
    length_unit : str
    """
    angle, (along, across, _) = np.sqrt((residuals[:, :3] ** 2).sum(1).mean()), axis_spread(T)[0]
    if angle > OPEN * across:
        length = np.sqrt((residuals[:, 3:] ** 2).sum(1).mean())
        raise ValueError(
            f"the loop does not close: even the rows that agree best miss by {np.rad2deg(angle):.3g} deg and "
            f"{length:.3g} {length_unit} (rms), while the poses turn by {np.rad2deg(along):.3g} deg about one axis and "
            f"by {np.rad2deg(across):.3g} deg across it: are the rows of both files in the same order?"
        )


@documented
def moved_block(kept, agree):
    """The block of rejected rows that agree among themselves.

    Parameters
    ----------
    kept : bool array, shape (n,)
    agree : bool
        Whether the rejected rows agree with one solution of their own.

    Returns
    -------
    block : (first, last) or None
        Rows counted from 1; None where the rejected rows are no block.
    """
    out = np.flatnonzero(~kept)
    if len(out) < 4 or not agree:
        return None
    first, last = out[0], out[-1]
    inside = (~kept[first : last + 1]).mean()
    return (int(first) + 1, int(last) + 1) if inside > 0.85 else None
