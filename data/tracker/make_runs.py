"""Write the synthetic logs beside this file: six calibration runs of 21 stops, and the joint angles they share.

    python data/tracker/make_runs.py            run in the workbook's folder

The logs of the report were never published. Procedure: labkit/machines/simulation.py, seeds 20181219 and 1 to 6.
"""

import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent.parent))

from labkit.machines import simulation
from labkit.machines.log import write_csv

LOST_STOPS = {1: 13, 4: 9}  # runs in which one stop is nonsense from beginning to end, as in the report's figure 8


def write(folder=HERE):
    """Write poses.csv and run_1.csv to run_6.csv into a folder."""
    joints_deg = np.round(np.rad2deg(simulation.measuring_joints()), 4)
    rows = [",".join([str(k), *(f"{v:.4f}" for v in row)]) for k, row in enumerate(joints_deg)]
    header = "stop," + ",".join(f"q{i} [deg]" for i in range(1, 7))
    (folder / "poses.csv").write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    for run in range(1, simulation.RUNS + 1):
        rng = np.random.default_rng([20181219, run])
        log = simulation.calibration_run(rng, joints=np.deg2rad(joints_deg), lost_stop=LOST_STOPS.get(run))
        write_csv(folder / f"run_{run}.csv", log)


if __name__ == "__main__":
    write()
