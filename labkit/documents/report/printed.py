"""What the report prints: the six runs of appendix D.

Source: report "Kalibrace a testovani systemu OTUS tracker", ZCU Plzen 2018; data/tracker.
"""

import numpy as np

from ...tables import read_table
from ..ledger import half_unit

COLUMNS = ("x", "y", "z", "qx", "qy", "qz", "qw", "E_trans", "E_rot", "mean_mm", "mean_deg", "max_mm", "max_deg")
RUNS = 6
POSES = 20  # measuring poses of a run besides the reference (21 in all)
UPSIDE_DOWN, COPIED = (2, COLUMNS.index("max_mm")), (3, COLUMNS.index("max_deg"))


def table_d():
    """Appendix D as printed: runs (6, 13), means (13,), variances (13,), and half a unit of the last digit of each,
    shape (8, 13)."""
    printed = read_table("tracker/table_d.csv", text=("run", *COLUMNS))
    words = np.column_stack([printed[c] for c in COLUMNS])
    values, halves = words.astype(float), np.vectorize(half_unit)(words)
    return values[:RUNS], values[RUNS], values[RUNS + 1], halves


def corrected_runs():
    """The runs with the one entry restored that the averages prove."""
    runs = table_d()[0].copy()
    runs[UPSIDE_DOWN] = 9.0
    return runs
