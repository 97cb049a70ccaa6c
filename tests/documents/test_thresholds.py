"""Thresholds of our own decide no status: rows keep theirs when each is made much smaller and much larger."""

import numpy as np
import pytest

from labkit.documents import ledger, misprints
from labkit.documents.thesis import claims_hand_eye, claims_optimization

SLIPS = [f"handeye.{name}" for name in ("C17_z_2", "C14_x_3", "C14_y_4", "C14_x_7", "C14_C_12", "C14_C_21", "C14_x_30")]
HESSIAN = [f"optimization.{name}" for name in ("H11", "H12", "H22_first", "H22_last", "gradient_1", "gradient_2")]
THRESHOLDS = [  # where, name, smaller and larger, rows it takes part in
    (misprints, "EXPLAINED", (3.0, 6.0), SLIPS),
    (misprints, "SUSPICIOUS", (5.0, 8.0), SLIPS),
    (misprints, "TURNED", np.deg2rad((0.12, 0.9)), SLIPS),
    (claims_hand_eye, "ZERO", (1e-12, 1e-3), ["handeye.kim_equation", "handeye.repeatability_base"]),
    (claims_optimization, "DIFFERENCES", (1e-6, 1.0), HESSIAN),
]


@pytest.mark.parametrize("where, name, others, rows", THRESHOLDS, ids=[name for _, name, _, _ in THRESHOLDS])
def test_no_status_hangs_on_a_threshold(where, name, others, rows, monkeypatch):
    stated = {row.id: row for row in ledger.rows() if row.id in rows}
    assert len(stated) == len(rows) and all(other != getattr(where, name) for other in others)
    try:
        for other in others:
            monkeypatch.setattr(where, name, other)
            claims_hand_eye._suspects.cache_clear()
            for row in stated.values():
                assert ledger.judge(row, ledger.function_of(row).__wrapped__()) == row.status
    finally:
        claims_hand_eye._suspects.cache_clear()
