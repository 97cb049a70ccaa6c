"""What the report prints: its packet, its motions and the six runs of appendix D.

What a machine is made of stands with the machine: the TX40's link lengths and limits (appendix B) in `machines.arm`,
the packet's fields (table 1) in `machines.packet`; a robot on the bench has them without any document.
Source: report "Kalibrace a testovani systemu OTUS tracker", ZCU Plzen 2018; data/tracker.
"""

from typing import NamedTuple

import numpy as np

from ...tables import read_table
from .. import rounding

COLUMNS = ("x", "y", "z", "qx", "qy", "qz", "qw", "E_trans", "E_rot", "mean_mm", "mean_deg", "max_mm", "max_deg")
RUNS = 6
POSES = 20  # measuring poses of a run besides the reference (21 in all)
UPSIDE_DOWN, COPIED = (2, COLUMNS.index("max_mm")), (3, COLUMNS.index("max_deg"))


class TableD(NamedTuple):
    """Appendix D as printed; columns as in `COLUMNS`, positions in m.

    Attributes
    ----------
    runs : array, shape (6, 13)
    mean, variance : arrays, shape (13,)
        The rows *Průměr* and *Rozptyl*.
    half_units : array, shape (8, 13)
        Half a unit in the last printed digit of every entry.
    """

    runs: np.ndarray
    mean: np.ndarray
    variance: np.ndarray
    half_units: np.ndarray


def table_d():
    """The six runs with their averages and variances.

    Returns
    -------
    TableD

    Source: report, appendix D.
    """
    values, halves = rounding.read(table_d_texts())
    return TableD(values[:RUNS], values[RUNS], values[RUNS + 1], halves)


def run_minutes():
    """When the six runs of appendix D were taken, as their file names say, in minutes after the first.

    Returns
    -------
    minutes : array, shape (6,)

    Source: report, appendix D, *Zdrojový soubor dat měření*.
    """
    names = read_table("tracker/table_d.csv", text=("run", *COLUMNS))["run"][:RUNS].tolist()
    clock = [name.removesuffix(".csv").rpartition("_")[2] for name in names]
    minutes = np.array([60.0 * int(time[:2]) + int(time[2:]) for time in clock])
    return minutes - minutes[0]


def table_d_texts():
    """Appendix D digit by digit.

    Returns
    -------
    texts : array of str, shape (8, 13)
        Six runs, *Průměr*, *Rozptyl*; columns as in `COLUMNS`.

    Source: report, appendix D.
    """
    printed = read_table("tracker/table_d.csv", text=("run", *COLUMNS))
    return np.column_stack([printed[c] for c in COLUMNS])


def statements():
    """Numbers that the report states in sentences: guarantees, mean and largest errors, the offset, the latency.

    Returns
    -------
    statements : dict
        {name: number}; the units stand in data/tracker/statements.csv.

    Source: report, introduction, end of section 3.2, conclusion; the latency from appendix A.
    """
    table = read_table("tracker/statements.csv", text=("name", "unit"))
    return dict(zip(table["name"].tolist(), table["value"].tolist()))


def corrected_runs():
    """The runs with the one entry restored that the averages prove.

    Returns
    -------
    runs : array, shape (6, 13)

    Source: report, appendix D; data/tracker/table_d_corrections.csv.
    """
    runs = table_d().runs.copy()
    runs[UPSIDE_DOWN] = 9.0
    return runs


def packet_bytes():
    """The bytes of each field of a packet, as printed, such as "0-7".

    Returns
    -------
    bytes : array of str, shape (23,)

    Source: report, section 2, table 1.
    """
    return read_table("tracker/packet.csv", text=("bytes", "meaning"))["bytes"]


def motions():
    """The approximate speeds of the four motions.

    Returns
    -------
    motions : dict
        {column: array (4,)}: motion, and the lowest and highest speed (m/s) and angular speed (rad/s).

    Source: report, section 3.2.
    """
    return read_table("tracker/motions.csv", text=("motion",))
