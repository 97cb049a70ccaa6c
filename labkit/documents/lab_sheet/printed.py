"""What the lab sheet prints, and the synthetic counterparts of what it measured and never published.

Source: lab sheet "Kalibrierung", Hochschule Darmstadt 2016; data/frames, data/chaining, data/quirlen.
"""

import numpy as np

from ...calibration.pivot import poses_from_euler
from ...tables import read_table


def printed_transforms():
    """The four transforms of listing 7 as printed (mm), shape (4, 4, 4), in the order of the listing."""
    return _printed("chaining/transforms.csv")


def printed_product():
    """Their product as the sheet prints it (mm), shape (4, 4)."""
    return _printed("chaining/product.csv")[0]


def _printed(name):
    table = read_table(name)
    return np.column_stack([table[c] for c in ("c1", "c2", "c3", "c4")]).reshape(-1, 4, 4)


def station_points():
    """The synthetic measurements (mm), shape (4 stations, 2 frames, 3 points, 3): K_s and K_s+1 seen from station s."""
    table = read_table("chaining/points.csv", text=("frame", "point"))
    return np.column_stack([table[c] for c in "xyz"]).reshape(4, 2, 3, 3)


def points():
    """The six printed points as {frame: array (3, 3)}, rows origin, x_point, y_point."""
    table = read_table("frames/points.csv", text=("frame", "point"))
    xyz = np.column_stack([table["x"], table["y"], table["z"]])
    return {name: xyz[table["frame"] == name] for name in ("K0", "K1")}


POSE_COLUMNS = ("x", "y", "z", "a_deg", "b_deg", "c_deg")


def poses_in_listing():
    """Number of poses in the unpublished Kreisel.txt, from the line numbers of the printed output.

    Each "Ptest" block takes five lines: heading, three numbers, blank. The last block must end right before the line
    of s0.
    """
    table = read_table("quirlen/listing.csv", text=("text",))
    first, last, end = table["line"].astype(int)
    if (last - first) % 5 or last + 5 != end:
        raise ValueError(
            f"quirlen/listing.csv: blocks of five lines do not fit between the lines {first}, {last} and {end}"
        )
    return (last - first) // 5 + 1


def kreisel_poses():
    """The synthetic counterpart of Kreisel.txt: T_WF (mm), shape (12, 4, 4)."""
    table = read_table("quirlen/poses.csv")
    return poses_from_euler(np.column_stack([table[c] for c in POSE_COLUMNS]))
