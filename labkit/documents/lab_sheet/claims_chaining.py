"""Lab sheet, section 2: four printed transforms, their product, and what rounding and the sum sign explain."""

import functools

import numpy as np

from ...geometry import chaining, frames
from .. import rounding
from ..ledger import Computed, computes
from ..slips import HERE, explained_by, single_slips
from . import printed as lab_sheet

NOTEBOOK = "02_chaining"


def _measured(station):
    value = chaining.transforms_from_points(lab_sheet.station_points()[station])
    off = np.abs(value - lab_sheet.printed_transforms()[station]).max()
    proof = (
        "The measured frames were never published. The synthetic three-point measurements of data/chaining/points.csv"
        f" were solved from the printed matrices and give this one to within {off:.1e}: such measurements are possible."
    )
    return Computed(value, simulated=True, proof=proof)


@computes("chaining.T_12")
def first_link():
    return _measured(0)


@computes("chaining.T_34")
def second_link():
    return _measured(1)


@computes("chaining.T_56")
def third_link():
    return _measured(2)


@computes("chaining.T_78")
def fourth_link():
    return _measured(3)


def _whole(rows):
    """(4, 4) transforms from their upper three rows; (..., 3, 4) -> (..., 4, 4)."""
    last = np.broadcast_to([0.0, 0.0, 0.0, 1.0], (*rows.shape[:-2], 1, 4))
    return np.concatenate([rows, last], axis=-2)


@computes("chaining.product", "chaining.T_Ist")
def product():
    links = lab_sheet.printed_transforms()
    value, bound = rounding.propagate(lambda rows: chaining.chain(_whole(rows)), lab_sheet.printed_links())
    lever = np.linalg.norm(chaining.stations(links)[1:, :3, 3] - value[:3, 3], axis=-1).max()
    off = np.abs(value - lab_sheet.printed_product())
    unrounded = chaining.chain(chaining.transforms_from_points(lab_sheet.station_points()))
    met = np.abs(unrounded - lab_sheet.printed_product()).max()
    proof = (
        f"The product of the printed matrices misses the printed product by up to {off[:3, 3].max():.1e} mm and "
        f"{off[:3, :3].max():.1e}; rounding to six decimals can move it by {bound[:3, 3].max():.1e} mm (levers up to "
        f"{lever:.0f} mm) and {bound[:3, :3].max():.1e}. Links inside the rounding exist whose product is the "
        f"printed one: those of points.csv meet it within {met:.1e}."
    )
    return Computed(value, bound=bound, proof=proof)


@computes("chaining.Soll", "chaining.T_Soll")
def ideal():
    proof = "What a closed loop must give, whatever was measured: it leads back to where it began."
    return Computed(chaining.chain(chaining.distribute_closure(lab_sheet.printed_transforms())), proof=proof)


@functools.cache
def _combined(how):
    links = lab_sheet.printed_transforms()
    return links.sum(0) if how == "sum" else chaining.chain(links)


@computes("chaining.operator")
def operator():
    """Which of the two the formula's sign can mean; a slip in an entry of the printed result is tried as well."""
    bound = rounding.propagate(lambda rows: chaining.chain(_whole(rows)), lab_sheet.printed_links())[1]
    printed = {HERE: "sum"} | {(i, j): f"{x:.6f}" for (i, j), x in np.ndenumerate(lab_sheet.printed_product())}

    def holds(d):
        result = np.array([float(d[place]) for place in np.ndindex(4, 4)]).reshape(4, 4)
        return bool((np.abs(_combined(d[HERE]) - result) <= bound + lab_sheet.HALF_DIGIT).all())

    def others(text):
        return ("product",) if text == "sum" else single_slips(text)

    found, total = explained_by(printed, holds, others), _combined("sum")
    proof = (
        f"The printed result has 1 in its last entry; the sum of the four matrices has {total[3, 3]:.0f} there and "
        f"is not a rigid transform. The product meets the printed result within {bound.max():.0e} mm, which rounding "
        f"explains; of all single slips in the {len(printed) - 1} entries of the result none explains the sum."
    )
    return Computed("sum" if holds(printed) else found[HERE][0], slips=found, proof=proof)


@computes("chaining.frames_read")
def frames_read():
    """Each transform leads from one measured frame to another."""
    return Computed(2 * len(lab_sheet.printed_transforms()))


@computes("chaining.nearly_ideal")
def nearly_ideal():
    angle, distance = frames.pose_distance(lab_sheet.printed_product(), np.eye(4))
    bound = rounding.propagate(lambda rows: chaining.chain(_whole(rows)), lab_sheet.printed_links())[1]
    return Computed(
        None,
        proof=f"The printed product misses the identity by {distance:.3f} mm and {np.rad2deg(angle):.3f} deg, "
        f"{distance / bound[:3, 3].max():.0f} times what six decimals hide. How near is near the sheet does not "
        "say: no accuracy of its measurements is printed.",
    )
