"""What one may declare on a Stage: points to drag, sliders, choices, toggles, time, a target to reach.

The front end (`stage.js`) draws all of them from `declare(name)`, a plain dict, and speaks in positions: the number of
a slider's step, of a word, 0 or 1. What a position means, and how its value is written, is known here alone.
"""

import re
from dataclasses import dataclass

import numpy as np

from ..checks import as_finite, shown
from . import style

FEW_WORDS = 3  # so many stand side by side; more go into a drop-down
LONGEST = 64  # letters of a target: one line over the narrowest picture


@dataclass(frozen=True)
class Handle:
    """A point to drag. Two coordinates: data coordinates of the axes number `ax`. Three: a point in space, for Stages
    with a view.

    step : what an arrow key moves it by (ten times with Shift); by default a hundredth of the axes' width.
    bounds : ((x_low, x_high), (y_low, y_high)[, (z_low, z_high)]); equal ends fix a coordinate. Drags end at the axes'
        limits anyway.
    label : what a screen reader calls it (default: its name); color : of its ring, one of `stage.style`.
    way : how it moves in space, one of `stage.scene3d_handles`; by default in the plane of the screen.
    """

    at: tuple
    step: float | None = None
    bounds: tuple | None = None
    ax: int = 0
    label: str = ""
    color: str = style.INK
    way: object = None


@dataclass(frozen=True)
class Slider:
    """A number between `low` and `high`; integers stay integers. `log` spreads it over the decades."""

    low: float
    high: float
    value: float
    step: float | None = None
    label: str = ""
    log: bool = False

    def check(self, name, value):
        value = float(as_finite(value, name))
        if not self.low - 1e-9 <= value <= self.high * (1 + 1e-9) + 1e-9:
            raise ValueError(f"{name} must lie in [{shown(self.low)}, {shown(self.high)}], got {shown(value)}")
        return round(value) if self.integer else value

    @property
    def integer(self):
        return all(isinstance(v, (int, np.integer)) for v in (self.low, self.high, self.value, self.step or 1))

    @property
    def _scale(self):
        """(low, high, step) of the track; in decades when it is logarithmic, with `value` on a step."""
        if not self.log:
            return self.low, self.high, self.step or (1 if self.integer else (self.high - self.low) / 100)
        low, value, high = np.log10([self.low, self.value, self.high]).tolist()
        below = round(100 * (value - low) / (high - low))
        return low, high, (value - low) / below if below else (high - low) / 100

    @property
    def positions(self):
        """The number of the last step; it ends at `high`, whatever is left of it."""
        low, high, step = self._scale
        return int(np.ceil((high - low) / step - 1e-9))

    def position(self, value):
        """The step nearest to a value."""
        low, high, step = self._scale
        there = np.log10(value) if self.log else value
        below = int(np.clip(np.floor((there - low) / step + 1e-9), 0, self.positions - 1))
        return min(below, below + 1, key=lambda k: abs(min(low + k * step, high) - there))

    def at(self, position):
        """The value of a step."""
        position = int(np.clip(position, 0, self.positions))
        if position == self.position(self.value):
            return self.value
        low, high, step = self._scale
        there = min(low + position * step, high)
        if self.integer:
            return round(there)
        return float(np.clip(10**there if self.log else round(there, 10), self.low, self.high))

    def text(self, value):
        """The value as it is written beside the slider."""
        if self.integer:
            return f"{value:d}"
        if self.log:
            return f"{value:.2g}"
        decimals = max(0, int(np.ceil(-np.log10(self._scale[2]) - 1e-9)))
        return f"{value:.{decimals}f}"

    def declare(self, name):
        label = self.label or name
        unit = re.search(r"\(([^()]+)\)$", label)
        return {"kind": "slider", "label": label, "positions": self.positions, "unit": unit[1] if unit else ""}


@dataclass(frozen=True)
class Choice:
    """One of several words; `options` is a list, or a dict {word: value}."""

    options: object
    value: object
    label: str = ""

    @property
    def _pairs(self):
        return list(self.options.items()) if isinstance(self.options, dict) else [(str(v), v) for v in self.options]

    def check(self, name, value):
        if value not in [v for _, v in self._pairs]:
            raise ValueError(f"{name} must be one of {', '.join(str(v) for _, v in self._pairs)}, got {value!r}")
        return value

    def position(self, value):
        return [v for _, v in self._pairs].index(value)

    def at(self, position):
        return self._pairs[int(np.clip(position, 0, len(self._pairs) - 1))][1]

    def text(self, value):
        return self._pairs[self.position(value)][0]

    def declare(self, name):
        words = [word for word, _ in self._pairs]
        return {"kind": "words" if len(words) <= FEW_WORDS else "list", "label": self.label or name, "words": words}


@dataclass(frozen=True)
class Toggle:
    """On or off."""

    value: bool = False
    label: str = ""

    def check(self, name, value):
        if not isinstance(value, (bool, np.bool_)):
            raise ValueError(f"{name} must be True or False, got {value!r}")
        return bool(value)

    def position(self, value):
        return int(value)

    def at(self, position):
        return bool(position)

    def text(self, value):
        return "on" if value else "off"

    def declare(self, name):
        return {"kind": "toggle", "label": self.label or name}


@dataclass(frozen=True)
class Play:
    """A control of time: `state["t"]` from 0 to t_max in steps of dt (s), `rate` times as fast as real time.

    start : where it stands at first and after Reset (s), so that no picture begins empty.
    """

    t_max: float
    dt: float = 0.05
    rate: float = 1.0
    start: float = 0.0

    @property
    def steps(self):
        return round(self.t_max / self.dt)

    def declare(self, patient):
        """`interval` (ms) from picture to picture, `stride` steps each; `patient` if none may be left out."""
        interval = max(20, round(1000 * self.dt / self.rate))
        stride = max(1, round(interval * self.rate / (1000 * self.dt)))
        return {"steps": self.steps, "interval": interval, "stride": stride, "patient": patient}


@dataclass(frozen=True)
class Target:
    """What one is to reach by touching; it stands over the picture and ends the caption.

    words : a noun phrase without a full stop, "a row of 32 links that ends within 5 mm", at most LONGEST letters.
    reached : function(result) -> whether a result reaches it; not that of the start.
    """

    words: str
    reached: object

    def __post_init__(self):
        if len(self.words) > LONGEST:
            raise ValueError(f"a target takes at most {LONGEST} letters, got {len(self.words)}: {self.words!r}")

    def told(self, is_reached):
        """The target as it is said."""
        return f"Target reached: {self.words}" if is_reached else f"Target: {self.words}"
