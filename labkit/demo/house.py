"""The Stages while they live: made when first shown or a step ahead, moved in one thread, small while nobody looks.

All that Stages compute and draw happens in one worker thread, so that votes are answered meanwhile; what they send
comes back to the thread of the server. They are made in a thread of their own: no key pressed meanwhile waits for
what is likely next, which takes seconds on a slow machine. A Stage keeps its state until the demo ends. Its pixels,
some 25 MB in a large window, are let go when neither it nor a neighbor is shown.
"""

import asyncio
import gc
import json
import struct
from concurrent.futures import ThreadPoolExecutor

AHEAD_AFTER = 0.25  # s without a message of a page until the next Stage is made: nobody is dragging then


def collect(to_stay=False):
    """Let garbage that refers to itself go now: exceptions in matplotlib's formula parser keep the frames that drew,
    and with them the pixels. `to_stay`: all that is left is never looked at again, so that the next call takes
    milliseconds instead of a fifth of a second; for a process that does nothing but a demo.
    """
    gc.collect()
    if to_stay:
        gc.freeze()


class House:
    """The Stages of a program.

    Parameters
    ----------
    makers : {key: function() -> Stage}
    send : function(key, frame)
        Called in the server's thread with each message of a Stage, as `framed` packs it.
    complain : function(sentence)
        Called in the server's thread with what went wrong beyond what a Stage says itself.
    made : function(key, stage)
        Called in the server's thread when a Stage is ready that is likely next: a page may say its size, `draw_ahead`.

    `collect` is called when a Stage was made, which is to stay, and when pixels were let go: it does nothing unless the
    process is the demo's own.
    """

    def __init__(self, makers, send, complain, made):
        self.makers, self.send, self.complain, self.made = makers, send, complain, made
        self.stages, self.faults = {}, {}
        self.collect = lambda to_stay=False: None
        self.worker = ThreadPoolExecutor(1, thread_name_prefix="stages")
        self.maker = ThreadPoolExecutor(1, thread_name_prefix="maker")
        self.loop = asyncio.get_running_loop()
        self._waiting, self._timer = [], None

    async def get(self, key):
        """(Stage, "") or (None, why it could not be made)."""
        if key not in self.stages and key not in self.faults:
            await asyncio.wrap_future(self._submit(self._make, key, to=self.maker))
        return self.stages.get(key), self.faults.get(key, "")

    def receive(self, key, message, done):
        """One message of a page to a Stage; it answers by `send`, and `done()` is called in the server's thread."""
        self._later()
        self._submit(self._receive, key, message).add_done_callback(lambda _: self._in_loop(done))

    def prepare(self, keys, shown):
        """From now on these are likely next; of the others but `shown`, the pixels are let go."""
        self._waiting = [key for key in keys if key not in self.faults]
        self._later()
        return self._submit(self._forget, {*keys, *shown})

    def draw_ahead(self, key, look):
        """Draw a Stage in the size it will have, for nobody yet."""
        return self._submit(self._receive, key, {"look": look, "serial": "ahead"})

    def warm(self, key):
        """Draw a Stage in the size it was designed for: with that begins whatever its size on a page will be."""
        width, height = self.stages[key].declaration()["size"]
        return self.draw_ahead(key, {"width": width, "height": height, "ratio": 1.0, "dark": False, "space": True})

    def start_again(self):
        """All Stages as they were in the beginning."""
        return self._submit(self._reset)

    def close(self):
        """No more work; what is under way ends."""
        if self._timer:
            self._timer.cancel()
        for thread in (self.maker, self.worker):
            thread.shutdown(wait=False, cancel_futures=True)

    def _later(self):
        if self._timer:
            self._timer.cancel()
        self._timer = self.loop.call_later(AHEAD_AFTER, self._ahead) if self._waiting else None

    def _ahead(self):
        self._timer = None
        key = self._waiting.pop(0)
        self._submit(self._make_ahead, key, to=self.maker)
        self._later()

    def _submit(self, work, *words, to=None):
        """Hand work to the worker, or `to` the maker; whatever it raises becomes one sentence."""

        def safely():
            try:
                work(*words)
            except Exception as error:  # a Stage may raise anything; the others go on
                self._in_loop(self.complain, f"{type(error).__name__}: {error}")

        return (to or self.worker).submit(safely)

    def _in_loop(self, call, *words):
        if not self.loop.is_closed():
            self.loop.call_soon_threadsafe(call, *words)

    # -- in the maker's thread

    def _make_ahead(self, key):
        self._make(key)
        if key in self.stages:
            self._in_loop(self.made, key, self.stages[key])

    def _make(self, key):
        if key in self.stages or key in self.faults:
            return
        try:
            stage = self.makers[key]()
            stage.connect(lambda message, buffers: self._in_loop(self.send, key, framed(message, buffers)))
        except Exception as error:  # whatever its compute raises
            self.faults[key] = f"This Stage could not be made: {_sentence(error)}"
            return
        self.stages[key] = stage
        self.collect(to_stay=True)

    # -- in the worker's thread

    def _receive(self, key, message):
        if key in self.stages:
            self.stages[key].receive(message)

    def _forget(self, kept):
        others = [stage for key, stage in list(self.stages.items()) if key not in kept]
        for stage in others:
            stage.forget_pixels()
        if others:
            self.collect()

    def _reset(self):
        for stage in list(self.stages.values()):
            stage.reset()


def _sentence(error):
    words = " ".join(str(error).split())
    return words if type(error) is ValueError else f"{type(error).__name__}: {words}".rstrip(": ")


def framed(message, buffers=()):
    """A message with its buffers as bytes: number of parts, length of each (uint32), then the parts, JSON first."""
    parts = [json.dumps(message).encode(), *(memoryview(b).cast("B") if len(b) else b"" for b in buffers)]
    return b"".join([struct.pack(f"<{1 + len(parts)}I", len(parts), *map(len, parts)), *parts])
