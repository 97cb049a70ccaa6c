"""Robot calibration and localization, one module a topic.

The mathematics lives in the modules of this folder and needs NumPy and SciPy alone; `figures` draws it, `widgets` makes
the figures touchable, `course` holds the exercises, and `ledger` recomputes every number the four documents print.
"""
