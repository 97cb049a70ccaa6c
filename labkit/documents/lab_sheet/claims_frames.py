"""Lab sheet, section 1: the axes, both frames and K0_T_K1 from the six printed points."""

from ...geometry import frames
from ..ledger import Computed, computes
from .printed import points

NOTEBOOK = "01_frames"


def _frame(name):
    return frames.frame_from_points(*points()[name])


@computes("frames.W_T_K0")
def first_frame():
    return Computed(_frame("K0"))


@computes("frames.W_T_K1")
def second_frame():
    return Computed(_frame("K1"))


@computes("frames.K0_axes")
def first_axes():
    return Computed(_frame("K0")[:3, :3].T)


@computes("frames.K1_axes")
def second_axes():
    return Computed(_frame("K1")[:3, :3].T)


@computes("frames.K0_T_K1", "frames.T")
def first_to_second():
    return Computed(frames.relative(_frame("K0"), _frame("K1")))
