"""The report's calibration runs, simulated: its logs were never published. Lengths are mm.

Source: data/tracker; the truth of the simulation is the report's result.
"""

import numpy as np

from ...geometry.frames import quaternion_from_matrix
from ...machines import simulation
from ...machines.log import average_stops, read_csv
from ...machines.mounting import calibrate_mounting
from ...tables import DATA, read_table
from .printed import RUNS


def synthetic_table():
    """The six synthetic runs in the columns and units of appendix D.

    Returns
    -------
    runs : array, shape (6, 13)
        As `printed.TableD.runs`; E_trans in m.
    """
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


def stop_poses():
    """Poses of the flange at the 21 stops of every synthetic run.

    Returns
    -------
    T_BF : array, shape (21, 4, 4), mm
    """
    poses = read_table("tracker/poses.csv")
    return simulation.flange_poses(np.deg2rad(np.column_stack([poses[f"q{i} [deg]"] for i in range(1, 7)])))


def synthetic_log(run):
    """The log of a synthetic run, 1 to 6.

    Returns
    -------
    labkit.machines.log.Log
    """
    return read_csv(DATA / f"tracker/run_{run}.csv")


def synthetic_mountings():
    """The mounting that each of the six synthetic logs gives.

    Returns
    -------
    mountings : list of labkit.machines.mounting.Mounting
    """
    T_BF, runs = stop_poses(), range(1, RUNS + 1)
    return [calibrate_mounting(T_BF, average_stops(synthetic_log(run))[0]) for run in runs]
