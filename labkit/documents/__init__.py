"""What four documents print, and what it comes to when it is computed again.

lab_sheet, thesis, report, lecture
            `printed` holds what each prints, read from `data/`; `claims_*` recompute it, row by row of the ledger
ledger      rows, statuses, totals
rounding    what printed digits hide, and how far that can move a result
slips       which single slip would explain a misprint: all are tried
circular    rows that would follow their own printed answer
strict      the ledger as text, circular rows refused
misprints   which single slip of a typist explains a reading that does not fit
redundancy  how large an error must be to be seen: what each would have had to measure besides
pages       the ledger as tables for the README and for chapter 10
"""
