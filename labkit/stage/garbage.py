"""Garbage is let go while nothing moves.

Now and then Python looks through everything it holds for rings of objects that nobody else knows: 0.1 s in a kernel
with figures, and it takes no care that a handle is being dragged. From the first figure on that pass waits ten times as
long, and whenever a figure has come to rest it is made up for.
"""

import gc

USUAL = 10  # passes through what is young until one through everything, as Python begins
PATIENT = 100


def wait_for_rest():
    """From now on a pass through everything waits for `at_rest`, though not forever."""
    young, middle, old = gc.get_threshold()
    if old < PATIENT:
        gc.set_threshold(young, middle, PATIENT)


def at_rest():
    """Nobody moves a figure: what has waited is done now."""
    if gc.isenabled() and gc.get_count()[2] >= USUAL:
        gc.collect()
