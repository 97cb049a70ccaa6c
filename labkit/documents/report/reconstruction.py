"""The report's calibration runs, simulated: its logs were never published. See data/tracker."""

import numpy as np

from ...machines import simulation
from ...machines.log import average_stops, read_csv
from ...machines.mounting import calibrate_mounting
from ...machines.packet import quaternion_from_matrix
from ...tables import DATA, read_table
from .printed import RUNS


def synthetic_table():
    """The six synthetic runs in the columns and units of appendix D (E_trans in m), shape (6, 13)."""
    rows = []
    for m in synthetic_mountings():
        q = quaternion_from_matrix(m.T_FE[:3, :3])
        angles_deg = np.rad2deg(m.rotation[1:])
        errors = [
            np.nanmean(m.translation[1:]),
            np.nanmean(angles_deg),
            np.nanmax(m.translation),
            np.nanmax(angles_deg),
        ]
        rows.append([*m.T_FE[:3, 3] / 1000, *-q, m.E_trans / 1000, m.E_rot, *errors])
    return np.array(rows)


def synthetic_mountings():
    """`calibrate_mounting` on the six synthetic logs in data/tracker."""
    poses = read_table("tracker/poses.csv")
    joints = np.deg2rad(np.column_stack([poses[f"q{i} [deg]"] for i in range(1, 7)]))
    T_BF = simulation.flange_poses(joints)
    logs = [read_csv(DATA / f"tracker/run_{run}.csv") for run in range(1, RUNS + 1)]
    return [calibrate_mounting(T_BF, average_stops(log)[0]) for log in logs]
