"""One Stage of a notebook on the page of the demo: `stages.scan_line().show("window")`.

The page is served by the kernel itself, from a thread of its own, for as long as the kernel lives. It shows the very
Stage of the notebook, which sends its pictures to both.
"""

import asyncio
import os
import re
import threading
import webbrowser

from .program import Card, Program
from .show import Demo

SECONDS = 10


class Windows:
    """The page of one kernel; its cards are the Stages shown so far."""

    def __init__(self):
        self.program, self.demo, self.loop = Program([], {"window": "From the notebook"}), None, None
        self.lock = threading.Lock()

    def show(self, stage):
        """The address of a Stage's card."""
        key = f"window/{re.sub(r'[^a-z0-9]+', '-', stage.name.lower()).strip('-')}"
        card = Card(key, "window", stage.name, key, make=lambda: stage)
        with self.lock:
            if self.loop is None:
                self.loop = asyncio.new_event_loop()
                threading.Thread(target=self.loop.run_forever, name="window", daemon=True).start()
            asyncio.run_coroutine_threadsafe(self._add(card), self.loop).result(SECONDS)
        return f"{self.demo.address}#{key}"

    async def _add(self, card):
        cards = self.program.cards
        cards[:] = [*(other for other in cards if other.key != card.key), card]
        self.demo = self.demo or Demo(self.program)
        house = self.demo.session.house
        house.makers[card.key] = card.make
        house.stages.pop(card.key, None)


WINDOWS = Windows()


def open_window(stage):
    """Open a Stage's page in the browser of this machine; returns what to tell.

    Raises
    ------
    ValueError
        Where the kernel runs on another machine than the browser, or no port is free.
    """
    if "JUPYTERHUB_USER" in os.environ:
        raise ValueError("A window of its own needs a kernel on your own machine; here, Enlarge fills this window.")
    address = WINDOWS.show(stage)
    webbrowser.open(address)
    return f"{stage.name} in a window of its own: {address}"
