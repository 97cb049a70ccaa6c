"""The error budget of the whole cell beside thousands of cells that were calibrated anew from raw readings.

    python tests/bench/cell_budget.py [2000]

Prints, for each place of the part, the standard deviation of the miss (mm) as the budget has it and as the simulation
finds it, and the chi-square per degree of freedom of the misses. 2000 cells take about 20 s.
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from labkit.machines import cell as cells

PLACES = (cells.LEARNED, (190.0, 100.0, 0.3), (60.0, 250.0, 1.5), (-60.0, 240.0, 2.0))


def main(count):
    found = [cells.calibrated_cell(np.random.default_rng([11, k])) for k in range(count)]
    for touched in (False, True):
        for now in PLACES:
            job = cells.simulated_job(now, touched=touched)
            rng, misses, scores, budget = np.random.default_rng(5), [], [], 0.0
            for cell in found:
                sources = cells.source_covariances(cell, job)
                errors = {n: rng.multivariate_normal(np.zeros(len(sources[n])), sources[n], method="svd")
                          for n in ("marks", "first reading", "second reading")}  # fmt: skip
                miss = cells.miss(cells.TRUTH, cell, job, cells.with_errors(cell, job, errors)[1])
                covariance = sum(cells.miss_budget(cell, job).values())
                budget += np.trace(covariance) / count
                misses.append(miss)
                scores.append(miss @ np.linalg.solve(covariance, miss))
            print(
                f"{'touched' if touched else 'seen':8} at {now}: budget {np.sqrt(budget):.3f} mm, "
                f"simulated {np.sqrt((np.square(misses)).sum(1).mean()):.3f} mm, chi2/3 {np.mean(scores) / 3:.3f}"
            )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 2000)
