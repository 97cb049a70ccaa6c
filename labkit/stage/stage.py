"""Stage: the base of all interaction, a live figure with handles, at most three controls, Reset, "Make it fail".

A Stage is four small things: a pure function from state to result, a scene that draws it, handles one can drag, and a
way to make it fail:

    from .stage import Handle, Stage, slider

    def compute(state):                                   # pure, at module level, tested without a browser
        return {"distance": np.hypot(*(state["P"] - state["Q"])) + state["offset"]}

    def distance():
        def scene(fig):                                   # called once: static things, and the artists that move
            ax = style.axes(fig.subplots(), "x (mm)", "y (mm)", equal=True)
            ax.set(xlim=(0, 10), ylim=(0, 6))
            (line,) = ax.plot([], [], **style.look("estimate"))
            def update(state, result):                    # sets artists in place; cheap
                line.set_data(*np.transpose([state["P"], state["Q"]]))
            return [line], update                         # the moving artists, and their update
        return Stage("distance", scene=scene, compute=compute,
                     handles={"P": Handle((1, 2), step=0.1), "Q": Handle((7, 3), step=0.1)},
                     controls={"offset": slider(0, 5, 0, step=0.1, label="offset (mm)")},
                     fail={"Q": (1, 2)},                  # what "Make it fail" changes, on top of the initial state
                     describe=lambda result: f"The points are {result['distance']:.1f} mm apart.")

The state is a dict: handle name -> array([x, y]) in data coordinates, control name -> value, "t" (s) with `play`,
"view" with `view`, "click" -> array([x, y]) or None, "brush" -> array (n, 2), "memory" with `advance`. Functions get a
copy they may not write into.

Speed. The aim is 50 ms from event to picture. Only the artists returned by the scene are drawn in a frame; everything
else is background, kept until something in it changes (limits, titles, ticks, legend), which costs about 40 ms. So:
keep limits fixed, return as artists all that moves, use one artist with many points rather than many artists,
`set_data` and friends rather than new artists, and put changing numbers into `ax.text` returned as an artist, not into
titles. Artists are drawn in order of their zorder, always above the background.

Looks. Colors come from `figures.style`; the dark theme is applied while drawing, nothing is to be done for it
(colormapped images stay as they are). The axes are laid out once a size, with what the scene drew at first. Narrow
cells crowd the picture to 85 % of `size` and then scale it down, so leave words that much room.

Tests need no browser: `stage.set(P=(3, 2))`, then `stage.result`, `stage.caption`, `stage.status`, `stage.png()`;
`stage.make_it_fail()`, `stage.reset()`, `stage.buttons["name of a preset"].click()`.

What else there is
------------------
constrain : handles that must follow a rule beyond `bounds`. `constrain(state, moved)` returns {name: value} to
    correct, before anything is computed; `moved` is the set of names that changed (all names at the start). The
    picture's handle goes where it returns.
Handle((x, y, z)) : a point of a 3D scene; needs `view`. It is drawn where `state["view"].project` puts it in the axes,
    and dragged in the plane of the screen.
view=View(azimuth_deg, elevation_deg) : dragging empty space (or arrow keys on the picture) turns `state["view"]`; see
    `figures.scene3d`.
play=Play(t_max, dt) : play, pause and a slider of time; `state["t"]` runs from 0 to t_max (s).
click=True (or the number of the axes) : `state["click"]` is the place clicked last, None at first.
brush=True (or the number of the axes) : `state["brush"]` is the path of the stroke being drawn in empty space (the
    last one, once drawn).
keys=True : arrow keys on the focused picture are events "up", "down", "left", "right" for `advance`.
start, advance : simulations that go on from what was. `start(state)` returns the memory (at the start, at Reset and at
    a preset), `advance(state, event)` returns the next one: event is "tick" (each dt of `play`), "up" ... "right",
    "click" or "brush". Both functions see the memory so far as `state["memory"]` and return a new one, or the old one
    changed; draw random numbers from an rng in it.
stage.set(**changes) : the same from Python, from any thread or asyncio task; a few dozen times a second are fine, the
newest wins.

Errors. A Stage whose compute, scene or update raises cannot be built. Later, while it is being used, the sentence of a
ValueError (or the type and text of anything else) appears under the figure and the last good picture stays; with the
environment variable LABKIT_STRICT=1 it is raised as well.
"""

import os
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from time import monotonic

import anywidget
import ipywidgets
import numpy as np

from ..checks import as_finite, shown
from . import style
from .canvas import DRAWING, Picture

MAX_CONTROLS = 3
ORBIT_DEG_PER_PIXEL = 0.5
# pictures on their way to the browser, which acknowledges every other one; further ones wait until it has shown them,
# and then only the newest is drawn
MAX_UNSEEN = 3
RESERVED = ("t", "view", "click", "brush", "memory")


@dataclass(frozen=True)
class Handle:
    """A point to drag. Two coordinates: data coordinates of the axes number `ax`. Three: a point in space, for Stages
    with a view.

    step : what an arrow key moves it by (ten times with Shift); by default a hundredth of the axes' width.
    bounds : ((x_low, x_high), (y_low, y_high)[, (z_low, z_high)]); equal ends fix a coordinate. Drags end at the axes'
        limits anyway.
    label : what a screen reader calls it (default: its name); color : of its ring, one of `figures.style`.
    """

    at: tuple
    step: float | None = None
    bounds: tuple | None = None
    ax: int = 0
    label: str = ""
    color: str = style.INK


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

    def shown(self, value):
        """Where the knob stands: on a step or at the end. The browser would round any other number and send it back."""
        low, high, step = self._scale
        if self.integer:
            return value
        there = np.log10(value) if self.log else value
        at = min(low + round((there - low) / step) * step, high, key=lambda at: abs(at - there))
        return float(np.clip(10**at if self.log else round(at, 10), self.low, self.high))

    def widget(self, name):
        options = {
            "value": self.shown(self.value),
            "description": self.label or name,
            "style": {"description_width": "initial"},
            "layout": _wide(self.label or name),
        }
        low, high, step = self._scale
        if self.integer:
            return ipywidgets.IntSlider(min=low, max=high, step=step, **options)
        if self.log:
            return ipywidgets.FloatLogSlider(min=low, max=high, step=step, readout_format=".2g", **options)
        decimals = max(0, int(np.ceil(-np.log10(step) - 1e-9)))
        return ipywidgets.FloatSlider(min=low, max=high, step=step, readout_format=f".{decimals}f", **options)


@dataclass(frozen=True)
class Choice:
    """One of several words; `options` is a list, or a dict {word: value}."""

    options: object
    value: object
    label: str = ""

    @property
    def _pairs(self):
        return list(self.options.items()) if isinstance(self.options, dict) else [(str(v), v) for v in self.options]

    def shown(self, value):
        return value

    def check(self, name, value):
        if value not in [v for _, v in self._pairs]:
            raise ValueError(f"{name} must be one of {', '.join(str(v) for _, v in self._pairs)}, got {value!r}")
        return value

    def widget(self, name):
        label, words = self.label or name, [word for word, _ in self._pairs]
        options = {"options": self._pairs, "value": self.value, "description": label}
        if len(words) > 3:
            layout = {"width": f"{6 + 0.55 * (len(label) + max(map(len, words))):.0f}em", "max_width": "100%"}
            return ipywidgets.Dropdown(style={"description_width": "initial"}, layout=layout, **options)
        style = {"description_width": "initial", "button_width": "auto"}
        layout = {"display": "flex", "grid_gap": "0 6px", "width": "max-content", "max_width": "100%"}
        return ipywidgets.ToggleButtons(style=style, layout=layout, **options)


@dataclass(frozen=True)
class Toggle:
    """On or off."""

    value: bool = False
    label: str = ""

    def check(self, name, value):
        if not isinstance(value, (bool, np.bool_)):
            raise ValueError(f"{name} must be True or False, got {value!r}")
        return bool(value)

    def shown(self, value):
        return value

    def widget(self, name):
        return ipywidgets.Checkbox(
            value=self.value, description=self.label or name, indent=False, layout={"width": "auto"}
        )


@dataclass(frozen=True)
class Play:
    """A control of time: `state["t"]` from 0 to t_max in steps of dt (s), `rate` times as fast as real time."""

    t_max: float
    dt: float = 0.05
    rate: float = 1.0


class _Front(anywidget.AnyWidget):
    """The picture in the browser, and the handles over it."""

    _esm = Path(__file__).with_name("stage.js")
    _css = Path(__file__).with_name("stage.css")


class Stage(ipywidgets.VBox):
    """A figure one can touch; the module's docstring tells how to write one.

    Parameters
    ----------
    name : str
        Stable, short: it names the Stage in stored outputs and for screen readers.
    scene : function(fig) -> (artists, update)
        Draws once; `update(state, result)` sets the moving artists in place.
    compute : function(state) -> result
        Pure.
    handles, controls : dict
        {name: Handle}, {name: slider | choice | toggle}; at most three controls.
    fail : dict
        What "Make it fail" changes on top of the initial state.
    presets : dict, optional
        {button text: changes} for further buttons.
    describe : function(result) -> str, optional
        One sentence under the figure, also for screen readers.
    size : (width, height)
        In inches of 100 CSS pixels, at most; JupyterLab's usual cell is 7 to 9 inches wide.

    play, view, constrain, click, brush, keys, start, advance: see the module's docstring.

    Raises
    ------
    ValueError
        For more than three controls, unknown names in presets, names used twice, options that need one another.
    """

    def __init__(
        self, name, *, scene, compute, fail, handles=None, controls=None, presets=None, describe=None, size=(7.0, 4.2),
        play=None, view=None, constrain=None, click=None, brush=None, keys=False, start=None, advance=None,
    ):  # fmt: skip
        super().__init__()
        self.name = name
        self._handles, self._controls, self._play, self._presets = handles or {}, controls or {}, play, {}
        self._compute, self._describe, self._constrain = compute, describe, constrain
        self._start, self._advance, self._keys = start, advance, keys
        self._click, self._brush = (
            None if a is None or a is False else int(a is not True and a) for a in (click, brush)
        )
        self._check_options(view)
        self._state = {
            **{key: handle.at for key, handle in self._handles.items()},
            **{key: control.value for key, control in self._controls.items()},
            **({"t": 0.0} if play else {}),
            **({"view": view} if view else {}),
            **({"click": None} if click is not None else {}),
            **({"brush": np.empty((0, 2))} if brush is not None else {}),
            **({"memory": None} if advance else {}),
        }
        self._state = {key: self._checked(key, value) for key, value in self._state.items()}
        self.result, self.status, self.caption = None, "", ""
        self._front, self._sent, self._shown, self._waiting = _Front(), 0, 0, False
        self._attached = self._showing = False
        self._whole = True  # the page needs a whole picture, not only what changed
        self._received = monotonic()
        self._picture = Picture(scene, size)
        self._check_axes()
        self._correct(set(self._state))
        self.initial = dict(self._state)
        self._presets = {
            key: {k: self._checked(k, v) for k, v in changes.items()}
            for key, changes in {"Reset": {}, "Make it fail": fail, **(presets or {})}.items()
        }
        self._restart()
        self._recompute()
        self._picture.draw()
        self._text = f"[stage: {name}] {self.caption}".rstrip()
        self._front.on_msg(lambda _, message, buffers: self.receive(message))
        self._build_controls()

    def _check_options(self, view):
        where = f"Stage {self.name!r}"
        if len(self._controls) > MAX_CONTROLS:
            raise ValueError(
                f"{where}: at most {MAX_CONTROLS} controls, got {len(self._controls)}: split it into two figures"
            )
        names = [*self._handles, *self._controls]
        for key in names:
            if names.count(key) > 1 or key in RESERVED:
                raise ValueError(f"{where}: the name {key!r} is used twice or reserved ({', '.join(RESERVED)})")
        for key, handle in self._handles.items():
            if len(handle.at) not in (2, 3) or (len(handle.at) == 3 and view is None):
                raise ValueError(
                    f"{where}: handle {key!r} must have 2 coordinates, or 3 and the Stage a view; got {handle.at}"
                )
        if self._keys and not self._advance:
            raise ValueError(f"{where}: keys=True needs advance(state, event), which says what a key does")
        if (self._start is None) != (self._advance is None):
            raise ValueError(f"{where}: start and advance come together, got only one of them")
        if view is not None and self._brush is not None:
            raise ValueError(f"{where}: dragging empty space either turns the view or draws, got both view and brush")

    def _check_axes(self):
        count = len(self._picture.fig.axes)
        for key, ax in {
            **{k: h.ax for k, h in self._handles.items()},
            "click": self._click,
            "brush": self._brush,
        }.items():
            if ax is not None and not 0 <= ax < count:
                raise ValueError(
                    f"Stage {self.name!r}: {key} wants axes {ax}, but the scene has {count}, counted from 0"
                )

    # -- state

    @property
    def state(self):
        """A copy of the state."""
        return dict(self._state)

    def set(self, **changes):
        """Change the state from Python, as if handles and controls had been moved. From any thread; the newest wins.

        Raises ValueError for unknown names and values that do not fit; what compute refuses is shown under the figure.
        """
        self._apply({key: self._checked(key, value) for key, value in changes.items()})

    def reset(self):
        """What the button Reset does."""
        self._preset("Reset")

    def make_it_fail(self):
        """What the button "Make it fail" does."""
        self._preset("Make it fail")

    def _checked(self, key, value):
        """A value as the state holds it, or a ValueError that names it."""
        if key in self._controls:
            return self._controls[key].check(key, value)
        if key in self._handles:
            value = np.array(as_finite(value, key))
            count = len(self._handles[key].at)
            if value.shape != (count,):
                raise ValueError(f"{key} must have shape ({count},), got {value.shape}")
            return _frozen(self._bounded(key, value))
        if key not in RESERVED or key not in self._state:
            known = ", ".join(map(repr, self._state)) or "nothing"
            raise ValueError(f"Stage {self.name!r} has no {key!r} in its state, only {known}")
        if key == "t":
            return float(np.clip(as_finite(value, "t"), 0.0, self._play.t_max))
        if key == "brush" or (key == "click" and value is not None):
            return _frozen(np.array(as_finite(value, key)))
        return value

    def _bounded(self, key, value):
        bounds = self._handles[key].bounds
        return value if bounds is None else np.clip(value, *np.transpose(as_finite(bounds, f"bounds of {key}")))

    def _apply(self, changes, events=(), restart=False, reply=None):
        """Change the state, let the rules correct it, advance the memory, compute, update the picture, send it."""
        with DRAWING:
            before = self._state.get("t", 0.0)
            self._state = {**self._state, **changes}
            try:
                self._correct(set(changes))
                after = self._state.get("t", 0.0)
                if restart or (self._advance and after < before - 1e-9):
                    self._restart()
                    before = 0.0
                if self._advance and self._play:
                    ticks = round(after / self._play.dt) - round(before / self._play.dt)
                    events = [*["tick"] * ticks, *events]
                for event in events:
                    self._state = {**self._state, "memory": self._advance(self.state, event)}
                self._recompute()
            except Exception as error:
                self.status = str(error) if type(error) is ValueError else f"{type(error).__name__}: {error}"
                if os.environ.get("LABKIT_STRICT"):
                    raise
            finally:
                self._show_picture(reply)  # before the controls, whose messages keep the page busy
                self._show_controls()

    def _correct(self, moved):
        if self._constrain:
            corrections = self._constrain(self.state, moved) or {}
            self._state = {**self._state, **{key: self._checked(key, value) for key, value in corrections.items()}}

    def _restart(self):
        if self._start:
            self._state = {**self._state, "memory": None}
            self._state["memory"] = self._start(self.state)

    def _recompute(self):
        result = self._compute(self.state)
        with DRAWING:
            self._picture.update(self.state, result)
        self.result, self.status = result, ""
        self.caption = str(self._describe(result)) if self._describe else ""

    def _preset(self, key):
        kept = {} if key == "Reset" else {k: v for k, v in self._state.items() if k == "view"}
        if self._play:
            self._play_widget.playing = False
        self._apply({**self.initial, **kept, **self._presets[key]}, restart=True)

    # -- controls: plain ipywidgets

    def _build_controls(self):
        self._widgets = {key: control.widget(key) for key, control in self._controls.items()}
        for key, widget in self._widgets.items():
            widget.observe(partial(self._on_control, key), "value")
        rows = [self._front]
        if self._play:
            rows.append(self._build_play())
        if self._widgets:
            rows.append(_row(self._widgets.values()))
        buttons = []
        for key in self._presets:
            button = ipywidgets.Button(description=key, layout={"width": "auto"})
            button.on_click(lambda _, key=key: self._preset(key))
            buttons.append(button)
        self.buttons = dict(zip(self._presets, buttons))
        rows.append(_row(buttons))
        self.children = rows

    def _build_play(self):
        steps = round(self._play.t_max / self._play.dt)
        interval = max(20, round(1000 * self._play.dt / self._play.rate))
        stride = max(1, round(interval * self._play.rate / (1000 * self._play.dt)))
        self._play_widget = ipywidgets.Play(min=0, max=steps, step=stride, interval=interval, show_repeat=False)
        self._play_widget.observe(lambda change: self._on_tick(change["new"]), "value")
        # counts steps: of seconds the browser would send back its own roundings, and late ones would undo a Reset
        self._time = ipywidgets.IntSlider(
            min=0, max=steps, description="t = 0.00 s", readout=False,
            disabled=bool(self._advance), style={"description_width": "6.5em"}, layout=_wide("t = 0.00 s"),
        )  # fmt: skip
        self._time.observe(lambda change: self._on_time(change["new"] * self._play.dt), "value")
        return _row([self._play_widget, self._time])

    def _on_control(self, key, change):
        control = self._controls[key]
        if not self._showing and not _same(control.shown(self._state[key]), change["new"]):
            self._apply({key: control.check(key, change["new"])})

    def _on_tick(self, tick):
        """A tick of the play button. One that was under way when Reset stopped the clock is set right, not obeyed."""
        if self._play_widget.playing or tick == 0:
            self._on_time(tick * self._play.dt)
        elif not self._showing:
            self._show_controls()

    def _on_time(self, t):
        if not self._showing and abs(self._state["t"] - t) > 1e-9:
            self._apply({"t": self._checked("t", t)})

    def _show_controls(self):
        self._showing = True  # the controls' own observers stay quiet
        for key, widget in self._widgets.items():
            widget.value = self._controls[key].shown(self._state[key])
        if self._play:
            self._time.value = self._play_widget.value = round(self._state["t"] / self._play.dt)
            self._time.description = f"t = {self._state['t']:.2f} s"
        self._showing = False

    # -- the browser: one message in flight, the newest wins

    def receive(self, message):
        """One message of the browser: everything that happened since the last one, merged."""
        with DRAWING:
            self._received = monotonic()
            self._shown = max(self._shown, message.get("shown", 0))
            if "look" in message:
                self._attached, self._shown, self._whole = True, self._sent, True
                self._picture.fit(**message["look"])
            changes, events = self._changes(message)
            if changes or events:
                self._apply(changes, events, reply=message.get("serial"))
            elif "serial" in message or self._waiting:
                self._show_picture(message.get("serial"))

    def _changes(self, message):
        """Changes of the state and events for `advance` in a message of the browser."""
        changes, events = {}, []
        for key, fraction in message.get("drag", {}).items():
            changes[key] = self._moved(key, to=fraction)
        for key, steps in message.get("step", {}).items():
            changes[key] = self._moved(key, steps=steps)
        if "orbit" in message and "view" in self._state:
            changes["view"] = self._state["view"].turned(*(ORBIT_DEG_PER_PIXEL * np.array(message["orbit"])))
        if self._keys:
            events += message.get("arrows", [])
        if "click" in message and self._click is not None:
            ax = self._picture.fig.axes[self._click]
            if ax.in_axes(_at(self._picture, message["click"])):
                changes["click"] = self._picture.data(ax, message["click"])
                events += ["click"] if self._advance else []
        if "brush" in message and self._brush is not None:
            path = self._picture.data(self._picture.fig.axes[self._brush], message["brush"])
            changes["brush"] = path if message.get("fresh") else np.concatenate([self._state["brush"], path])
            events += ["brush"] if self._advance else []
        return changes, events

    def _moved(self, key, to=None, steps=None):
        """Where a handle goes: dragged to a fraction of the picture, or by steps (right, up); in axes and bounds."""
        handle, at = self._handles[key], self._state[key]
        ax = self._picture.fig.axes[handle.ax]
        view = self._state.get("view")
        here = view.project(at)[:2] if len(at) == 3 else at
        (left, right), (bottom, top) = np.sort(ax.get_xlim()), np.sort(ax.get_ylim())
        if to is None:
            step = handle.step or (right - left) / 100
            there = here + step * np.array(steps, dtype=float)
        else:
            there = self._picture.data(ax, to)
        there = np.clip(there, (left, bottom), (right, top))
        return self._bounded(key, there if len(at) == 2 else at + view.unproject(there - here))

    def _show_picture(self, reply=None):
        """One picture to the browser; one that has not yet shown the last three gets the newest as soon as it has."""
        if not self._attached:
            return
        if reply is None and self._sent - self._shown >= MAX_UNSEEN:
            self._waiting = True
            return
        self._waiting = False
        self._sent += 1
        if reply is not None:
            self._shown = self._sent  # the page waits for this one
        buffers = self._picture.news(self._whole)
        self._whole = False
        front = {
            "picture": self._sent,
            "on": self._sent - 1 if len(buffers) == 2 else None,
            "serial": reply,
            "width": round(self._picture.width),
            "handles": self._places(),
            "name": self.name,
            "caption": self.caption,
            "status": self.status,
            "empty": "turn" if "view" in self._state else "draw" if self._brush is not None else "",
            "keys": self._keys,
            "click": self._click is not None,
            "milliseconds": round(1e3 * (monotonic() - self._received), 1),
        }
        self._front.send(front, buffers)

    def _places(self):
        """Where the browser puts the handles, and what it says of them."""
        places = {}
        for key, handle in self._handles.items():
            at = self._state[key]
            here = self._state["view"].project(at)[:2] if len(at) == 3 else at
            places[key] = {
                "at": self._picture.fraction(self._picture.fig.axes[handle.ax], here),
                "label": handle.label or key,
                "value": ", ".join(f"{letter} {value:.4g}" for letter, value in zip("xyz", at)),
                "now": float(at[0]),
                "color": style.themed(handle.color, self._picture.dark),
            }
        return places

    # -- without a browser

    def png(self):
        """The picture as PNG bytes."""
        return self._picture.png()

    def __repr__(self):
        return self._text

    def _repr_mimebundle_(self, **kwargs):
        bundle = super()._repr_mimebundle_(**kwargs)
        return {**bundle, "text/plain": self._text, "image/png": self.png()}


def _wide(label):
    """Room for a label, the track of a slider and its number."""
    return {"width": f"{18 + 0.55 * len(label):.0f}em", "max_width": "100%"}


def _same(a, b):
    """Equal but for what decimal fractions lose on their way through a browser."""
    return a == b or (isinstance(a, float) and abs(a - b) <= 1e-9 * max(abs(a), abs(b)))


def _frozen(array):
    array.setflags(write=False)
    return array


def _row(children):
    return ipywidgets.HBox(
        list(children), layout={"flex_flow": "row wrap", "align_items": "center", "grid_gap": "0 10px"}
    )


def _at(picture, fraction):
    """What `Axes.in_axes` asks for: an event with pixel coordinates."""

    @dataclass
    class Event:
        x: float
        y: float

    return Event(fraction[0] * picture.fig.bbox.width, (1 - fraction[1]) * picture.fig.bbox.height)
