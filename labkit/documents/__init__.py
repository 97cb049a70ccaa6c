"""What four documents print, and what it comes to when it is computed again.

lab_sheet, thesis, report, lecture
            `printed` holds what each prints, read from `data/`; `claims_*` recompute it, row by row of the ledger
ledger      rows, statuses, totals
misprints   which single slip of a typist explains a reading that does not fit
redundancy  how large an error must be to be seen: what each would have had to measure besides
pages       the ledger as tables for the README and for chapter 10
"""
