"""Robot calibration and localization, on four storeys; imports go down only.

chapters      what belongs to one notebook: exercises, figures, stages
documents     what the four documents print, and their claims recomputed
mathematics   geometry, estimation, calibration, machines, localization; tuned twins in `fast`
checks        what arrives at the border (`tables` reads what lies in `data/`)

Beside them stand two engines that know no chapter: `exercises` judges an answer, `stage` is a figure one can touch.
`verbs` is the command line.
"""
