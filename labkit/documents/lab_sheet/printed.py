"""What the lab sheet prints, and the synthetic counterparts of what it measured and never published.

Lengths are mm. Source: lab sheet "Kalibrierung", Hochschule Darmstadt 2016; data/frames, data/chaining, data/quirlen.
"""

import numpy as np

from ...calibration.pivot import poses_from_euler
from ...tables import read_table
from ..rounding import read

HALF_DIGIT = 0.5e-6  # half a unit in the last of the six decimals of listing 7
S0_LISTING_10 = 0.443922  # mm
POSE_COLUMNS = ("x", "y", "z", "a_deg", "b_deg", "c_deg")


def points():
    """The six measured points of the two frames.

    Returns
    -------
    points : dict
        {"K0": array (3, 3), "K1": array (3, 3)}, rows origin, x_point, y_point; the sheet names no unit.

    Source: lab sheet, section 1.
    """
    table = read_table("frames/points.csv", text=("frame", "point"))
    xyz = np.column_stack([table["x"], table["y"], table["z"]])
    return {name: xyz[table["frame"] == name] for name in ("K0", "K1")}


def printed_transforms():
    """The four transforms of the loop, in the order of the listing.

    Returns
    -------
    T : array, shape (4, 4, 4), mm

    Source: lab sheet, section 2, listing 7.
    """
    return _matrices("chaining/transforms.csv")


def printed_product():
    """The product of the four transforms.

    Returns
    -------
    T : array, shape (4, 4), mm

    Source: lab sheet, section 2, listing 7.
    """
    return _matrices("chaining/product.csv")[0]


def printed_links():
    """The four transforms with the half units of their digits; the last rows are exact.

    Returns
    -------
    rounding.Printed
        Arrays of shape (4 links, 3 rows, 4 columns).

    Source: lab sheet, section 2, listing 7.
    """
    columns = ("c1", "c2", "c3", "c4")
    table = read_table("chaining/transforms.csv", text=columns)
    return read(np.column_stack([table[c] for c in columns]).reshape(4, 4, 4)[:, :3])


def _matrices(name):
    table = read_table(name)
    return np.column_stack([table[c] for c in ("c1", "c2", "c3", "c4")]).reshape(-1, 4, 4)


def station_points():
    """The synthetic measurements behind the four transforms: frames K_s and K_s+1 seen from station s.

    Returns
    -------
    points : array, shape (4 stations, 2 frames, 3 points, 3), mm

    Source: none; the sheet's measurements were never published. See data/chaining.
    """
    table = read_table("chaining/points.csv", text=("frame", "point"))
    return np.column_stack([table[c] for c in "xyz"]).reshape(4, 2, 3, 3)


def poses_in_listing():
    """Number of poses in the unpublished Kreisel.txt, from the line numbers of the printed output.

    Each "Ptest" block takes five lines: heading, three numbers, blank. The last block must end right before the line
    of s0.

    Returns
    -------
    count : int

    Raises
    ------
    ValueError
        When blocks of five lines do not fit between the printed line numbers.

    Source: lab sheet, section 3, output of the listing.
    """
    table = read_table("quirlen/listing.csv", text=("text",))
    first, last, end = table["line"].astype(int)
    if (last - first) % 5 or last + 5 != end:
        raise ValueError(
            f"quirlen/listing.csv: blocks of five lines do not fit between the lines {first}, {last} and {end}"
        )
    return (last - first) // 5 + 1


def kreisel_poses():
    """The synthetic counterpart of Kreisel.txt: poses of a tool that swirls about its tip.

    Returns
    -------
    T_WF : array, shape (12, 4, 4), mm

    Source: none; the file was never published. See data/quirlen.
    """
    table = read_table("quirlen/poses.csv")
    return poses_from_euler(np.column_stack([table[c] for c in POSE_COLUMNS]))
