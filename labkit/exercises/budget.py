"""How long an explanation may be looked for: one budget for a check, and of it a part for each kind of explanation."""

import time

from . import guard

LOOKING = 1.2  # seconds of processor time, from the beginning of a check, in which an explanation is looked for
SPECIAL = 0.8  # more, where an answer is right on some draws only, for what the others have in common
PART = 0.25  # of a budget that one kind of explanation may take
SHARE = 0.1  # of this, in which one of many attempts must begin to give results: it may have a loop without an end


def seconds():
    """A clock that stands still while the processor serves others, where that is known."""
    return time.perf_counter() - guard.Starved.seconds()


class Budget:
    """Seconds of processor time from now on, here and in another process that works for this one.

    Code that only waits, in a sleep say, has `guard.PATIENCE` times as long.
    """

    def __init__(self, limit):
        self.limit, self.worked, self.began = limit, _worked(), seconds()

    def left(self):
        """Seconds that are left; 0 where there are none."""
        waiting = guard.PATIENCE * self.limit - (seconds() - self.began)
        return max(0.0, min(self.limit - (_worked() - self.worked), waiting))

    def part(self):
        """The budget of one kind of explanation."""
        return Budget(min(PART * self.limit, self.left()))

    def share(self):
        """The budget of one of many attempts of a kind."""
        return Budget(min(SHARE * self.limit, self.left()))


def _worked():
    return time.thread_time() + guard.Abroad.worked
