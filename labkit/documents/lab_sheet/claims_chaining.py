"""Lab sheet, section 2: four printed transforms, their product, and what rounding and the sum sign explain."""

import numpy as np

from ...geometry import chaining
from ..ledger import Computed, computes
from . import printed as lab_sheet

NOTEBOOK = "02_chaining"


def _measured(station):
    value = chaining.transforms_from_points(lab_sheet.station_points()[station])
    off = np.abs(value - lab_sheet.printed_transforms()[station]).max()
    proof = (
        "The measured frames were never published. The synthetic three-point measurements of data/chaining/points.csv"
        f" give this matrix to within {off:.1e}."
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


@computes("chaining.product", "chaining.T_Ist")
def product():
    links = lab_sheet.printed_transforms()
    value, bound = chaining.chain(links), chaining.rounding_bound(links, lab_sheet.HALF_DIGIT)
    lever = np.linalg.norm(chaining.stations(links)[1:, :3, 3] - value[:3, 3], axis=-1).max()
    off = np.abs(value - lab_sheet.printed_product())
    unrounded = chaining.chain(chaining.transforms_from_points(lab_sheet.station_points()))
    met = np.abs(unrounded - lab_sheet.printed_product()).max()
    proof = (
        f"The product of the printed matrices misses the printed product by up to {off[:3, 3].max():.1e} mm and "
        f"{off[:3, :3].max():.1e}; rounding to six decimals can move it by {bound[:3, 3].max():.1e} mm (levers up to "
        f"{lever:.0f} mm) and {bound[:3, :3].max():.1e}. Links inside the rounding exist whose product is the printed "
        f"one: those of points.csv meet it within {met:.1e}."
    )
    return Computed(value, bound=bound, proof=proof)


@computes("chaining.Soll", "chaining.T_Soll")
def ideal():
    return Computed(chaining.chain(chaining.distribute_closure(lab_sheet.printed_transforms())))


@computes("chaining.operator")
def operator():
    """Which of the two the formula's sign can mean: the sum of the four matrices, or their product."""
    links = lab_sheet.printed_transforms()
    total, result = links.sum(0), chaining.chain(links)
    off = {"sum": np.abs(total - np.eye(4)).max(), "product": np.abs(result - np.eye(4)).max()}
    name = min(off, key=off.get)
    proof = (
        f"The printed result has 1 in its last entry; the sum of the four matrices has {total[3, 3]:.0f} there and is "
        "not a rigid transform. The product meets the printed result within "
        f"{chaining.rounding_bound(links, lab_sheet.HALF_DIGIT).max():.0e} mm, which rounding explains."
    )
    return Computed(name, misprint=name != "sum", proof=proof)


@computes("chaining.frames_read")
def frames_read():
    """Each transform leads from one measured frame to another."""
    return Computed(2 * len(lab_sheet.printed_transforms()))
