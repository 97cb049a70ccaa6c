"""The ledger keeps its word: every row has a computation, and the status it states is the one the numbers give."""

import pytest

from labkit.documents import ledger

ROWS = ledger.rows()


@pytest.mark.parametrize("row", ROWS, ids=[row.id for row in ROWS])
def test_row_has_the_status_it_states(row):
    computed = ledger.compute(row)
    assert ledger.judge(row, computed) == row.status, f"printed {row.printed}, computed {computed.value}"
    if row.status != "reproduced":
        assert computed.proof, "a number that does not come out needs its argument"


def test_every_computation_has_a_row():
    ledger._load_claims()
    used = {row.id.split("[")[0] for row in ROWS}
    assert set(ledger._functions) == used
