"""Stage: the base of all interaction, a live figure with handles, at most three controls, Reset, "Make it fail".

A Stage is four small things: a pure function from state to result, a scene that draws it, handles one can drag, and a
way to make it fail:

    from labkit.stage import Handle, Slider, Stage

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
                     controls={"offset": Slider(0, 5, 0, step=0.1, label="offset (mm)")},
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

Looks. Colors come from `stage.style`; the dark theme is applied while drawing, nothing is to be done for it
(colormapped images stay as they are). The axes are laid out once a size, with what the scene drew at first. Narrow
cells crowd the picture to 85 % of `size`, so leave words that much room; below, `stage.room` puts panels under each
other and takes the largest letters that leave the words apart.

Tests need no browser: `stage.set(P=(3, 2))`, then `stage.result`, `stage.caption`, `stage.status`, `stage.png()`;
`stage.make_it_fail()`, `stage.reset()`, `stage.press("name of a button")`.

What else there is
------------------
constrain : handles that must follow a rule beyond `bounds`. `constrain(state, moved)` returns {name: value} to
    correct, before anything is computed; `moved` is the set of names that changed (all names at the start). The
    picture's handle goes where it returns.
Handle((x, y, z)) : a point of a 3D scene; needs `view`. It is drawn where `state["view"].project` puts it in the axes,
    and dragged in the plane of the screen, or as its `way` says: along a line, on a plane or a sphere (see
    `stage.scene3d_handles`). `Dial` is an angle: a joint that is turned by a point on its circle.
view=View(azimuth_deg, elevation_deg) : dragging empty space (or arrow keys on the picture) turns `state["view"]`; see
    `stage.scene3d`. Where the browser draws the scene it turns it without Python, and tells where one looks from with
    its next message.
play=Play(t_max, dt) : play, pause and a slider of time; `state["t"]` runs from 0 to t_max (s).
click=True (or the number of the axes) : `state["click"]` is the place clicked last, None at first.
brush=True (or the number of the axes) : `state["brush"]` is the path of the stroke being drawn in empty space (the
    last one, once drawn).
keys=True : arrow keys on the focused picture are events "up", "down", "left", "right" for `advance`.
start, advance : simulations that go on from what was. `start(state)` returns the memory (at the start, at Reset and at
    a preset), `advance(state, event)` returns the next one: event is "tick" (each dt of `play`), "up" ... "right",
    "click" or "brush". Both functions see the memory so far as `state["memory"]` and return a new one, or the old one
    changed; draw random numbers from an rng in it. What it was is kept: time can be scrubbed backward, and forward
    again to what happened then, until something is touched in between.
target=Target(words, reached) : what one is to reach. It stands over the picture, hollow or with a check mark, and ends
    the caption, which a screen reader hears.
describe : a sentence that holds "{offset}", the name of a slider in braces, gets the slider's number there; in a page
    it can be dragged sideways, or moved by arrow keys, as the slider can.
stage.set(**changes) : the same from Python, from any thread or asyncio task; a few dozen times a second are fine, the
newest wins.

Errors. A Stage whose compute, scene or update raises cannot be built. Later, while it is being used, the sentence of a
ValueError (or the type and text of anything else) appears under the figure and the last good picture stays; with the
environment variable LABKIT_STRICT=1 it is raised as well.
"""

import re
from dataclasses import dataclass
from time import monotonic

import numpy as np

from .. import live
from ..checks import as_finite
from . import front, garbage, style
from .canvas import CSS_DPI, DRAWING, Picture
from .controls import Slider
from .scene3d_handles import Dial, stepped
from .tape import Tape

MAX_CONTROLS = 3
ORBIT_DEG_PER_PIXEL = 0.5
# pictures on their way to the browser, which acknowledges every other one; further ones wait until it has shown them,
# and then only the newest is drawn
MAX_UNSEEN = 3
RESERVED = ("t", "view", "click", "brush", "memory")
FAIL = "Make it fail"
NUMBER = re.compile(r"\{(\w+)\}")  # of a sentence: the name of a slider
EITHER = re.compile("\0(.*?)\0(.*?)\0")  # of a sentence: words with Python behind the page, and on a film
MAX_WAIT = 1.5  # s a page waits for steps of a simulation; the slider of time then goes back to what was reached


def living(words, recorded=""):
    """Words of a sentence that hold where Python answers, as an invitation to click; a film has the `recorded` ones."""
    return f"\0{words}\0{recorded}\0"


class Stage:
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
        {name: Handle}, {name: Slider | Choice | Toggle}; at most three controls.
    fail : dict
        What "Make it fail" changes on top of the initial state.
    because : str, optional
        What "Make it fail" has done and why that fails: the sentence before the caption until something is touched.
    presets : dict, optional
        {button text: changes} for further buttons.
    describe : function(result) -> str, optional
        One sentence under the figure, also for screen readers.
    size : (width, height)
        In inches of 100 CSS pixels, at most; JupyterLab's usual cell is 7 to 9 inches wide.

    play, view, constrain, click, brush, keys, start, advance, target: see the module's docstring.

    Raises
    ------
    ValueError
        For more than three controls, unknown names in presets, names used twice, options that need one another, a
        target that is reached before anything is touched.
    """

    def __init__(
        self, name, *, scene, compute, fail, handles=None, controls=None, presets=None, describe=None, because="",
        size=(7.0, 4.2), play=None, view=None, constrain=None, click=None, brush=None, keys=False, start=None,
        advance=None, target=None,
    ):  # fmt: skip
        self.name = name
        self._handles, self._controls, self._play, self._presets = handles or {}, controls or {}, play, {}
        self._compute, self._describe, self._constrain = compute, describe, constrain
        self._start, self._advance, self._keys, self._target = start, advance, keys, target
        self._click, self._brush = (
            None if a is None or a is False else int(a is not True and a) for a in (click, brush)
        )
        self._check_options(view)
        self._state = self._first_state(view)
        self.result, self.status, self.caption, self.reached, self._numbers = None, "", "", False, []
        self._sends, self._widget, self.at_rest = [], None, []
        self.recorded = False  # whether what it says is for a film, which answers less
        self._sent, self._shown, self._waiting, self._attached, self._epoch = 0, 0, False, False, 0
        self._because, self._said, self._tape = because, "", None
        self._cursor = ""
        self._whole = True  # the page needs a whole picture, not only what changed
        self._told_view = None  # where the page knows one looks from
        self._received = monotonic()
        self._picture = Picture(scene, size)
        self._check_axes()
        self._spaces = self._picture.spaces
        self._correct(set(self._state))
        self.initial = dict(self._state)
        self._presets = {
            key: {k: self._checked(k, v) for k, v in changes.items()}
            for key, changes in {"Reset": {}, FAIL: fail, **(presets or {})}.items()
        }
        if advance:
            self._restart()
            self._simulate(0, ())
        self._recompute()
        if self.reached:
            raise ValueError(f"Stage {name!r}: the target is reached before anything is touched: {target.words!r}")
        self._check_places()
        self._text = f"[stage: {name}] {self.caption}".rstrip()

    def _first_state(self, view):
        first = {
            **{key: handle.at for key, handle in self._handles.items()},
            **{key: control.value for key, control in self._controls.items()},
            **({"t": self._play.start} if self._play else {}),
            **({"view": view} if view else {}),
            **({"click": None} if self._click is not None else {}),
            **({"brush": np.empty((0, 2))} if self._brush is not None else {}),
            **({"memory": None} if self._advance else {}),
        }
        self._state = first  # what may be in it
        return {key: self._checked(key, value) for key, value in first.items()}

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
            if isinstance(handle, Dial):
                continue
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

    def _check_places(self):
        for space in self._spaces:
            if unset := space.unset():
                raise ValueError(f"Stage {self.name!r}: update gives no place to {unset[0]}: set it, or show(False)")

    # -- state

    @property
    def state(self):
        """A copy of the state."""
        return dict(self._state)

    @property
    def figure(self):
        """The matplotlib figure that is shown."""
        return self._picture.fig

    @property
    def moving(self):
        """The artists that move, as `scene` returned them."""
        return list(self._picture.artists)

    @property
    def spaces(self):
        """The scenes in space, `scene3d.Scene`."""
        return list(self._spaces)

    @property
    def handles(self):
        """{name: Handle}, a copy."""
        return dict(self._handles)

    def set(self, **changes):
        """Change the state from Python, as if handles and controls had been moved. From any thread; the newest wins.

        Raises ValueError for unknown names and values that do not fit; what compute refuses is shown under the figure.
        """
        self._apply({key: self._checked(key, value) for key, value in changes.items()})

    def reset(self):
        """What the button Reset does."""
        self._press("Reset")

    def make_it_fail(self):
        """What the button "Make it fail" does."""
        self._press(FAIL)

    def _checked(self, key, value):
        """A value as the state holds it, or a ValueError that names it."""
        if key in self._controls:
            return self._controls[key].check(key, value)
        if isinstance(self._handles.get(key), Dial):
            return self._handles[key].check(key, value)
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
        bounds, way = self._handles[key].bounds, self._handles[key].way
        if way is not None:
            value = way.keep(value)
        return value if bounds is None else np.clip(value, *np.transpose(as_finite(bounds, f"bounds of {key}")))

    def _apply(self, changes, events=(), restart=False, reply=None):
        """Change the state, let the rules correct it, advance the memory, compute, update the picture, send it."""
        with DRAWING:
            before = self._step
            self._state = {**self._state, **changes}
            if set(changes) - {"t", "view"} and not restart:
                self._said = ""
            try:
                self._correct(set(changes))
                if self._advance and restart:
                    self._restart()
                    before = 0
                elif self._tape and set(changes) - {"t", "view", "click", "brush"}:
                    self._tape.cut(before)
                if self._advance:
                    self._simulate(before, events, until=None if restart or reply is None else monotonic() + MAX_WAIT)
                self._recompute()
            except Exception as error:
                self.status = str(error) if type(error) is ValueError else f"{type(error).__name__}: {error}"
                if live.is_built():
                    raise
            finally:
                self._show_picture(reply)

    def _correct(self, moved):
        if self._constrain:
            corrections = self._constrain(self.state, moved) or {}
            self._state = {**self._state, **{key: self._checked(key, value) for key, value in corrections.items()}}

    def _restart(self):
        self._state = {**self._state, "memory": None}
        self._state["memory"] = self._start(self.state)
        if self._play:
            self._tape = Tape(self._play.steps)
            self._tape.keep(0, self._state["memory"])

    @property
    def _step(self):
        """The number of the step that time stands at."""
        return round(self._state["t"] / self._play.dt) if self._play else 0

    def _simulate(self, at, events, until=None):
        """Bring the memory from step `at` to the time of the state, from the tape as far as it goes, then to what
        happened there. The steps end early when the clock shows `until` (s), and time stands there.
        """
        wanted = self._step
        place, memory = self._tape.at(wanted) if self._tape and wanted != at else (at, None)
        if wanted < at or place > at:
            at, self._state = place, {**self._state, "memory": memory}
        while at < wanted and (until is None or monotonic() < until):
            at += 1
            self._state = {**self._state, "t": at * self._play.dt}
            self._advance_by("tick")
            self._tape.keep(at, self._state["memory"])
        for event in events:
            self._advance_by(event)
        if events and self._tape:
            self._tape.cut(at)
            self._tape.keep(at, self._state["memory"], always=True)

    def _advance_by(self, event):
        self._state = {**self._state, "memory": self._advance(self.state, event)}

    def _recompute(self):
        result = self._compute(self.state)
        for key, handle in self._handles.items():
            if isinstance(handle, Dial):
                handle.point(self._state[key], result)  # refused before anything is drawn
        with DRAWING:
            self._picture.update(self.state, result)
        self.result, self.status = result, ""
        self._say()

    def _say(self):
        """The caption, where the numbers of sliders stand in it, and the target over the picture."""
        told = [self._said, str(self._describe(self.result)) if self._describe else ""]
        if self._target:
            self.reached = bool(self._target.reached(self.result))
            goal = self._target.told(self.reached)
            self._picture.head(goal, self.reached)
            told.append(f"{goal}.")
        self.caption, self._numbers = "", []
        words = NUMBER.split(EITHER.sub(r"\2" if self.recorded else r"\1", " ".join(filter(None, told))))
        for text, key in zip(words[::2], [*words[1::2], None]):
            self.caption += text
            if isinstance(self._controls.get(key), Slider):
                number = self._controls[key].text(self._state[key])
                self._numbers.append([len(self.caption), len(self.caption) + len(number), key])
                self.caption += number
            elif key:
                self.caption += f"{{{key}}}"

    @property
    def buttons(self):
        """The names of all buttons: Reset, Make it fail, and the presets."""
        return tuple(self._presets)

    def press(self, button):
        """What a button does."""
        self._press(button)

    def _press(self, button, reply=None):
        """A button's changes on top of the initial state; a step of time that is under way comes too late from now."""
        if button not in self._presets:
            raise ValueError(f"Stage {self.name!r} has no button {button!r}, only {', '.join(self._presets)}")
        kept = {} if button == "Reset" else {k: v for k, v in self._state.items() if k == "view"}
        self._epoch += 1
        self._said = self._because if button == FAIL else ""
        self._apply({**self.initial, **kept, **self._presets[button]}, restart=True, reply=reply)

    # -- the page: one message in flight, the newest wins

    def declaration(self):
        """What the page must know once: names, controls, buttons, and what empty space is for."""
        return {
            "name": self.name,
            "size": [self._picture.size[0] * CSS_DPI, self._picture.size[1] * CSS_DPI],
            "handles": {key: handle.label or key for key, handle in self._handles.items()},
            "controls": {key: control.declare(key) for key, control in self._controls.items()},
            "play": self._play.declare(patient=self._advance is not None) if self._play else None,
            "buttons": self.buttons,
            "empty": "turn" if "view" in self._state else "draw" if self._brush is not None else "",
            "keys": self._keys,
            "click": self._click is not None,
            "spaces": [space.describe() for space in self._spaces],
            "home": self.initial["view"].describe() if "view" in self.initial else None,
        }

    def connect(self, send):
        """From now on pictures go to `send(message, buffers)` as well: a dict for JSON, and a list of bytes."""
        self._sends.append(send)

    def _send(self, message, buffers):
        for send in self._sends:
            send(message, buffers)

    def forget_pixels(self):
        """Let go of the picture while no page shows it; a page that shows it again begins with a `look`."""
        with DRAWING:
            self._attached = False
            self._picture.forget_pixels()

    def receive(self, message):
        """One message of the page: everything that happened since the last one, merged."""
        with DRAWING:
            self._received = monotonic()
            self._shown = max(self._shown, message.get("shown", 0))
            if "need" in message:
                self._send({"module": "space"}, [front.SPACE.read_bytes()])
            if "view" in message and "view" in self._state:
                self._state["view"] = self._told_view = self._state["view"].seen(message["view"])
                for space in self._spaces:
                    space.draw(self._told_view)
            if "look" in message:
                garbage.wait_for_rest()
                self._attached, self._shown, self._whole, self._told_view = True, self._sent, True, None
                self._picture.fit(**message["look"])
            if "cursor" in message:
                self._cursor = self._place_in_words(message["cursor"])
            if "button" in message:
                self._press(message["button"], reply=message.get("serial"))
            changes, events = self._changes(message)
            if changes or events:
                self._apply(changes, events, reply=None if "button" in message else message.get("serial"))
            elif "button" in message:
                pass  # it has been answered
            elif "serial" in message or self._waiting:
                self._show_picture(message.get("serial"))
            if "rest" in message:
                for store in self.at_rest:
                    store()
                garbage.at_rest()

    def _place_in_words(self, fraction):
        """Where the keyboard's cursor stands, for a screen reader."""
        number = self._click if self._click is not None else self._brush or 0
        x, y = self._picture.data(self._picture.fig.axes[number], fraction)
        return f"x {x:.3g}, y {y:.3g}"

    def _changes(self, message):
        """Changes of the state and events for `advance` in a message of the browser."""
        changes, events = {}, []
        for key, fraction in message.get("drag", {}).items():
            changes[key] = self._moved(key, to=fraction)
        for key, steps in message.get("step", {}).items():
            changes[key] = self._moved(key, steps=steps)
        for key, position in message.get("control", {}).items():
            changes[key] = self._controls[key].check(key, self._controls[key].at(position))
        time = message.get("time", {})
        if self._play and time.get("epoch") == self._epoch and "button" not in message:
            changes["t"] = self._checked("t", time["at"] * self._play.dt)
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
        (left, right), (bottom, top) = np.sort(ax.get_xlim()), np.sort(ax.get_ylim())
        if isinstance(handle, Dial) or handle.way is not None:
            there = None if to is None else self._picture.data(ax, to)
            return self._moved_in_space(key, at, there, steps, (right - left) / 100)
        view = self._state.get("view")
        here = view.project(at)[:2] if len(at) == 3 else at
        if to is None:
            step = handle.step or (right - left) / 100
            there = here + step * np.array(steps, dtype=float)
        else:
            there = self._picture.data(ax, to)
        there = np.clip(there, (left, bottom), (right, top))
        return self._bounded(key, there if len(at) == 2 else at + view.unproject(there - here))

    def _moved_in_space(self, key, at, there, steps, step):
        handle, view = self._handles[key], self._state["view"]
        if there is None and isinstance(handle, Dial):
            return handle.stepped(at, steps)
        if there is None:
            return self._bounded(key, stepped(handle.way, at, steps, view.axes, handle.step or step))
        eye, ray = view.ray(*there)
        if isinstance(handle, Dial):
            return handle.pull(at, self.result, eye, ray)
        return self._bounded(key, handle.way.pull(at, eye, ray, view.axes[2]))

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
        on = self._sent - 1 if len(buffers) == 2 else None
        space = self._space(buffers) if self._spaces and not self._picture.painted else None
        self._whole = False
        message = {
            "picture": self._sent,
            "on": on,
            "space": space,
            "serial": reply,
            "width": round(self._picture.width),
            "height": round(self._picture.height),
            "handles": self._places(),
            "controls": {key: self._shown_control(key) for key in self._controls},
            "time": self._shown_time(),
            "caption": self.caption,
            "numbers": self._numbers,
            "status": self.status,
            "cursor": self._cursor,
            "milliseconds": round(1e3 * (monotonic() - self._received), 1),
        }
        self._send(message, buffers)

    def _space(self, buffers):
        """What changed in the scenes the page draws itself; the numbers go to the buffers, as the last of them."""
        news = [space.news(self._whole) for space in self._spaces]
        buffers.append(np.concatenate([numbers for _, numbers in news]).tobytes())
        view = self._state.get("view")
        told = None if view is self._told_view or view is None else view.describe()
        self._told_view = view
        return {
            "places": [self._picture.place(space.ax) for space in self._spaces],
            "rows": [rows for rows, _ in news],
            "view": told,
        }

    def _shown_control(self, key):
        control, value = self._controls[key], self._state[key]
        return {"at": control.position(value), "text": control.text(value)}

    def _shown_time(self):
        if not self._play:
            return None
        t = self._state["t"]
        return {"at": round(t / self._play.dt), "text": f"t = {t:.2f} s", "epoch": self._epoch}

    def _places(self):
        """Where the browser puts the handles, and what it says of them."""
        places = {}
        scenes = {self._picture.fig.axes.index(space.ax): k for k, space in enumerate(self._spaces)}
        for key, handle in self._handles.items():
            at = self._state[key]
            point = handle.point(at, self.result) if isinstance(handle, Dial) else at
            here = self._state["view"].project(point)[:2] if len(point) == 3 else point
            values = [at] if isinstance(handle, Dial) else at
            letters = [""] if isinstance(handle, Dial) else ["x ", "y ", "z "]
            places[key] = {
                "at": self._picture.fraction(self._picture.fig.axes[handle.ax], here),
                "point": [float(v) for v in point] if len(point) == 3 else None,
                "scene": scenes.get(handle.ax, 0),
                "value": ", ".join(f"{letter}{value:.4g}" for letter, value in zip(letters, values))
                + (" deg" if isinstance(handle, Dial) else ""),
                "now": float(values[0]),
                "color": style.themed(handle.color, self._picture.dark),
            }
        return places

    # -- in a notebook, and without a page

    @property
    def widget(self):
        """The figure as a Jupyter widget, made when it is first asked for."""
        if self._widget is None:
            self._widget = front.widget(self)
        return self._widget

    def still(self):
        """The figure as it is now, as HTML that needs neither kernel nor script: picture, handles, caption."""
        return front.still(self)

    def png(self):
        """The picture as PNG bytes."""
        return self._picture.png()

    def in_both_themes(self):
        """The pixels on light and on dark paper, each of shape (height, width, 4)."""
        return self._picture.in_both_themes()

    def small_png(self):
        """The picture with the rings of its handles, at its own size and in few colors: for files.

        It is on light paper, also where the page is dark: what is stored is printed, exported and read elsewhere.
        """
        rings = [(place["at"], style.themed(self._handles[key].color, False)) for key, place in self._places().items()]
        return self._picture.small_png(rings)

    def __repr__(self):
        return self._text

    def show(self, where="cell"):
        """Show it beneath the running cell, or ("window") on a page of its own, that of `python lab.py demo`."""
        if where not in ("cell", "window"):
            raise ValueError(f'a Stage is shown in the "cell" or in a "window", got {where!r}')
        front.show(self) if where == "cell" else front.show_window(self)

    def _ipython_display_(self):
        front.show(self)


def _frozen(array):
    array.setflags(write=False)
    return array


@dataclass
class _Event:
    """What `Axes.in_axes` asks for, in pixels."""

    x: float
    y: float


def _at(picture, fraction):
    """A fraction of the picture as an event."""
    return _Event(fraction[0] * picture.fig.bbox.width, (1 - fraction[1]) * picture.fig.bbox.height)
