"""A Stage recorded: what it shows along its first handle, its first control, its failure and its play.

For pages without Python. A film is made by playing the page: messages go to `Stage.receive`, and what it would show is
kept, picture and words.
A phone gets a film of its own, laid out for its width: the letters of a wide one would be half as large there.
All pictures of a film share one list of at most 256 colors, each with its twin on dark paper, so that one recording
serves both themes. A picture is then one byte a pixel; each is stored as what differs from the one before (XOR), and
all together deflated: 3 to 10 kB a picture. `stage.js` shows a film as it shows a living Stage; `film.js` answers it.
What lies in space is not in the pictures: its description is kept once, and of each picture the numbers that Stage
sends a page that draws it; so it turns freely, and costs less.
"""

import base64
import copy
import zlib
from dataclasses import dataclass

import numpy as np

from . import scene3d, style
from .stage import FAIL

ROOM, RATIO = 600, 1.25  # CSS pixels of the recorded picture's width; pixels a CSS pixel
TALL = 4  # times as high a picture may become,
PHONE, PHONE_TALL = 340, 1.3  # on a phone so wide: caption and controls are seen with it
SPARSER = 2  # times fewer pictures has a film for a phone
AROUND, ALONG, TURNS = 36, 24, 36  # pictures around a loop, along a control, around a view
PLAYED, FAILED = 48, 32  # pictures of a play, and of a play that goes wrong
QUICKEST, SLOWEST = 60, 160  # ms from picture to picture
REACH = 0.17  # half axes of a handle's loop, as a share of its axes
MOVED = 0.004  # share of the picture a handle must move to count as moved
ORBIT_PIXELS = 20  # pixels of dragging from picture to picture of a view: 10 degrees
COLORS, NEAR = 256, 4
LEVEL = 7  # of deflate: a quarter of the time of level 9, for 3 % more
DIGITS = 13  # binary digits kept of a number in space: 1/16000 of itself
LARGEST, FEWEST = 400_000, 12  # bytes of a track; a larger one loses every second picture, down to so many
PLAYS = ("play", FAIL)
NOTED = ("caption", "numbers", "status", "controls", "time")  # of a message, beside its handles


@dataclass(frozen=True, eq=False)
class Film:
    """What was recorded of one Stage.

    declaration : dict
        What `stage.js` must know, less what was not recorded.
    size : (width, height)
        In pixels of the recording.
    palettes : (light, dark)
        Colors, each of shape (n, 3), uint8.
    tracks : dict
        {name: Track}: "start", "handle", "control", "view", "play", and one of each further button's name.
    space : Numbers
        What the notes of a Stage with scenes in space refer to; none otherwise.
    places : list
        Where its scenes are in the picture.
    narrow : bool
        Whether it was laid out for a phone.
    """

    declaration: dict
    size: tuple
    palettes: tuple
    tracks: dict
    space: object = None
    places: tuple = ()
    narrow: bool = False

    def as_data(self):
        """The film for `film.js`, as data for JSON."""
        palettes = [palette.ravel().tolist() for palette in self.palettes]
        tracks = {
            name: {"notes": track.notes, "entry": track.entry, "pictures": base64.b64encode(track.reel).decode()}
            for name, track in self.tracks.items()
        }
        data = {"declaration": self.declaration, "size": self.size, "palettes": palettes, "tracks": tracks}
        data["narrow"] = self.narrow
        return data if self.space is None else {**data, "space": self.space.as_data(), "places": self.places}


class Numbers:
    """What things in space were given, each different set of numbers and words once: `number(words, numbers)`."""

    def __init__(self):
        self.known, self.words, self.values = {}, [], []

    def number(self, words, numbers):
        key = words, numbers.tobytes()
        if key not in self.known:
            self.known[key] = len(self.values)
            self.words.append(words)
            self.values.append(numbers)
        return self.known[key]

    def as_data(self):
        """Counts, words, and all numbers: float32 of few digits, first bytes first, deflated."""
        every = _shortened(np.concatenate([np.empty(0, "<f4"), *self.values]).astype("<f4"))
        packed = zlib.compress(every.view(np.uint8).reshape(-1, 4).T.tobytes(), 9)
        counts = [len(values) for values in self.values]
        return {"counts": counts, "words": self.words, "numbers": base64.b64encode(packed).decode()}


def _shortened(numbers):
    """Numbers (float32) rounded to DIGITS binary digits: the rest would not be seen, and costs half the bytes."""
    mantissa, exponent = np.frexp(numbers)
    return np.ldexp(np.round(np.ldexp(mantissa, DIGITS)), exponent - DIGITS).astype("<f4")


@dataclass(frozen=True, eq=False)
class Track:
    """Pictures one after the other.

    notes : list of dict
        What the message of each picture says besides.
    reel : bytes
        The pictures, `deflated`.
    entry : int
        The picture one comes in at.
    """

    notes: list
    reel: bytes
    entry: int = 0


def deflated(pictures):
    """Pictures of one byte a pixel, shape (n, height, width), each as XOR with the one before, deflated."""
    change = pictures.copy()
    change[1:] ^= pictures[:-1]
    return zlib.compress(change.tobytes(), LEVEL)


def record(stage, narrow=False):
    """The film of a Stage, which is at its start again afterwards; `narrow`: the one for a phone."""
    stage.recorded = True
    try:
        return _Camera(stage, narrow).film()
    finally:
        stage.recorded = False
        stage.reset()


class _Camera:
    """Plays the page of one Stage, and keeps what it would show."""

    def __init__(self, stage, narrow):
        self.stage, self.heard, self.serial = stage, None, 0
        self.narrow, self.sparser = narrow, SPARSER if narrow else 1
        self.declared = stage.declaration()
        self.negatives, self.shots, self.entries = _Negatives(), {}, {}
        self.numbers, self.things = Numbers(), [[-1] * len(space["items"]) for space in self.declared["spaces"]]
        stage.connect(self.hear)
        self.look(space=bool(self.things))

    def look(self, **more):
        width, tall = (PHONE, PHONE_TALL) if self.narrow else (ROOM, TALL)
        self.tell(look={"width": width, "height": tall * width, "ratio": RATIO, "dark": False, **more})

    def hear(self, message, buffers):
        """What the Stage sends: the message, and what it changes in space."""
        self.heard = message
        if not message.get("space"):
            return
        numbers, used = np.frombuffer(buffers[-1], "<f4"), 0
        for things, rows in zip(self.things, message["space"]["rows"]):
            for k, shown, count, words in rows:
                things[k] = self.numbers.number(words, numbers[used : used + count]) if shown else -1
                used += count

    def tell(self, **message):
        """One message to the Stage; what it answers."""
        self.serial += 1
        self.stage.receive({**message, "serial": self.serial})
        return self.heard

    def shoot(self, name):
        """Add what is shown now to a track."""
        heard = self.heard
        notes, pictures = self.shots.setdefault(name, ([], []))
        handles = {
            key: {
                "at": [round(x, 4) for x in place["at"]],
                "value": place["value"],
                "now": place["now"],
                **({"point": np.round(place["point"], 5).tolist(), "scene": place["scene"]} if place["point"] else {}),
                "color": [style.themed(self.stage.handles[key].color, dark) for dark in (False, True)],
            }
            for key, place in heard["handles"].items()
        }
        note = {key: heard[key] for key in NOTED} | {"handles": handles}
        notes.append(note | ({"things": [list(things) for things in self.things]} if self.things else {}))
        pictures.append(self.negatives.develop(*self.stage.in_both_themes()))

    def film(self):
        self.tell(button="Reset")
        self.shoot("start")
        shown = {"handles": self._handle(), "controls": self._control()}
        self._view()
        self._play()
        for button in self.declared["buttons"][1:]:
            if button not in self.shots:
                self.tell(button=button)
                self.shoot(button)
        self.tell(button="Reset")
        places = self.heard["space"]["places"] if self.things else ()
        self.look(space=False)
        palettes, chosen = self.negatives.colors()
        tracks = {
            name: self._track(name, chosen[np.array(pictures)], shown) for name, (_, pictures) in self.shots.items()
        }
        _renumber(tracks, shown["controls"])
        height, width = self.shots["start"][1][0].shape
        declaration = self._declaration(shown, tracks)
        for name in shown["handles"]:
            self._draw_path(name, declaration, tracks)
        numbers = self.numbers if self.things else None
        return Film(declaration, (width, height), palettes, tracks, numbers, tuple(places), self.narrow)

    def _draw_path(self, name, declaration, tracks):
        """Where a handle was led in space, as one more thing of its scene."""
        places = [note["handles"][name] for note in tracks["handle"].notes]
        if "point" not in places[0]:
            return
        scene, points = places[0]["scene"], np.array([place["point"] for place in [*places, places[0]]], dtype="<f4")
        declaration["spaces"][scene]["items"].append(scene3d.described_path(style.MUTED, 1.2, ":"))
        number = self.numbers.number(None, points.ravel())
        for track in tracks.values():
            for note in track.notes:
                note["things"][scene].append(number)

    def _track(self, name, pictures, shown):
        """A track no larger than it may be: with every second picture of what is larger; the ends stay."""
        notes, places = self.shots[name][0], np.arange(len(pictures))
        reel = deflated(pictures)
        words = name == "control" and self.declared["controls"][shown["controls"][0]]["kind"] != "slider"
        while len(reel) > LARGEST / self.sparser and len(places) > FEWEST and not words:
            places = np.unique(np.append(places[::2], places[-1]))
            reel = deflated(pictures[places])
        notes = [self._note(notes[k], shown) for k in places]
        entry = int(np.abs(places - self.entries.get(name, 0)).argmin())
        return Track(notes, reel, entry)

    def _note(self, note, shown):
        chosen = {key: _only(note[key], names) for key, names in shown.items()}
        return copy.deepcopy({**note, **chosen})

    def _declaration(self, shown, tracks):
        declared = copy.deepcopy({**self.declared, **{key: _only(self.declared[key], shown[key]) for key in shown}})
        for name in shown["controls"]:
            control, last = declared["controls"][name], len(tracks["control"].notes) - 1
            if control["kind"] == "slider":
                control["positions"] = last
        if declared["play"]:
            interval = declared["play"]["interval"] * declared["play"]["steps"] / declared["play"]["stride"]
            steps = len(tracks["play"].notes) - 1
            interval = round(min(max(interval / steps, QUICKEST), SLOWEST))
            declared["play"] = {"steps": steps, "interval": interval, "stride": 1, "patient": False}
        empty = "turn" if "view" in tracks or self.things else ""
        none = {"keys": False, "click": False}
        return {**declared, **none, "buttons": list(declared["buttons"]), "empty": empty}

    # -- the tracks

    def _handle(self):
        """Along a loop through its start, or to and fro where it can go one way only; the names of what moves."""
        for name in self.declared["handles"]:
            self.tell(button="Reset")
            path = self._path(name)
            if path is None:
                continue
            self.tell(button="Reset")
            for at in path:
                self.tell(drag={name: at})
                self.shoot("handle")
            self.tell(button="Reset")
            return [name]
        return []

    def _path(self, name):
        """Fractions of the picture to drag a handle along; None if it does not move."""
        axes = self.stage.figure.axes[self.stage.handles[name].ax].get_position()
        middle = np.array([axes.x0 + axes.width / 2, 1 - axes.y0 - axes.height / 2])
        reach = REACH * np.array([axes.width, axes.height])
        start = np.array(self.heard["handles"][name]["at"])
        goes = np.array([self._goes(name, start, step) for step in np.diag(np.where(middle < start, -reach, reach))])
        if not goes.any():
            return None
        count = AROUND // self.sparser
        if goes.all():
            inward = (middle - start) / np.array([axes.width, axes.height])
            away = np.arctan2(-inward[1], -inward[0]) if np.hypot(*inward) > 0.05 else np.pi
            angles = away + np.linspace(0, 2 * np.pi, count, endpoint=False)
            ring = np.column_stack([np.cos(angles), np.sin(angles)])
            return start + reach * (ring - ring[0])
        half = np.array([axes.width, axes.height]) / 2 * goes
        share = np.linspace(-0.97, 0.97, count)[:, None]
        return np.where(goes, middle + share * half, start)

    def _goes(self, name, start, step):
        """Whether a handle follows a step at least half way."""
        self.tell(button="Reset")
        moved = np.array(self.tell(drag={name: start + step})["handles"][name]["at"]) - start
        return abs(moved @ step) > max(0.5 * step @ step, MOVED**2)

    def _control(self):
        """Through all positions of the first control, at most ALONG of them; its name in a list."""
        for name, declared in self.declared["controls"].items():
            last = declared.get("positions", len(declared.get("words", ["off", "on"])) - 1)
            most = ALONG // self.sparser if declared["kind"] == "slider" else ALONG
            at = np.unique(np.linspace(0, last, min(last + 1, most)).round().astype(int))
            start = self.heard["controls"][name]["at"]
            at = np.unique([*at, start])
            for position in at.tolist():
                self.tell(button="Reset")
                self.tell(control={name: position})
                self.shoot("control")
            self.entries["control"] = at.tolist().index(start)
            self.tell(button="Reset")
            return [name]
        return []

    def _view(self):
        if self.declared["empty"] != "turn" or self.things:
            return
        for turn in range(TURNS):
            if turn:
                self.tell(orbit=[ORBIT_PIXELS, 0])
            self.shoot("view")
        self.tell(button="Reset")

    def _play(self):
        if not self.declared["play"]:
            return
        steps = self.declared["play"]["steps"]
        for button, name, count in (("Reset", "play", PLAYED), (FAIL, FAIL, FAILED)):
            begun = self.tell(button=button)["time"]["at"]
            at = np.unique(np.linspace(0, steps, count // self.sparser + 1).round().astype(int))
            self.entries[name] = int(np.abs(at - begun).argmin())
            for step in at.tolist():
                self.tell(time={"at": step, "epoch": self.heard["time"]["epoch"]})
                self.shoot(name)


def _renumber(tracks, controls):
    """Positions of a control, and times, counted among the recorded ones."""
    for name in controls:
        recorded = np.array([note["controls"][name]["at"] for note in tracks["control"].notes])
        for track in tracks.values():
            for note in track.notes:
                place = note["controls"][name]
                place["at"] = int(np.abs(recorded - place["at"]).argmin())
    for name in PLAYS:
        for number, note in enumerate(tracks[name].notes if name in tracks else ()):
            if note["time"]:
                note["time"]["at"] = number


def _only(table, names):
    return {key: value for key, value in table.items() if key in names}


class _Negatives:
    """Pictures as numbers of colors, each color of light paper together with its twin on dark paper.

    New colors are looked for only where a picture differs from the one before; those nearer than NEAR have one number,
    and the mean of their pixels.
    """

    def __init__(self):
        self.known, self.numbers = np.empty(0, np.int64), np.empty(0, np.uint32)
        self.counts, self.sums = np.empty(0), np.empty((0, 6))
        self.before = None

    def develop(self, light, dark):
        """The numbers of a picture's colors, shape (height, width)."""
        keys = _packed(np.concatenate([light[..., :3], dark[..., :3]], -1))
        if self.before is None:
            self.before = np.full_like(keys, -1), np.zeros(keys.shape, np.uint32)
        changed = keys != self.before[0]
        found, inverse, counts = np.unique(keys[changed], return_inverse=True, return_counts=True)
        picture = self.before[1].copy()
        picture[changed] = self._numbered(_unpacked(found), counts)[inverse]
        self.before = keys, picture
        return picture

    def _numbered(self, colors, counts):
        """The numbers of colors, shape (n, 6); new ones get the next."""
        coarse = _packed((colors + NEAR // 2) // NEAR)
        new = np.setdiff1d(coarse, self.known)
        known = np.concatenate([self.known, new])
        order = np.argsort(known)
        numbers = np.arange(len(self.known), len(known), dtype=np.uint32)
        self.known, self.numbers = known[order], np.concatenate([self.numbers, numbers])[order]
        self.counts = np.concatenate([self.counts, np.zeros(len(new))])
        self.sums = np.concatenate([self.sums, np.zeros((len(new), 6))])
        at = self.numbers[np.searchsorted(self.known, coarse)]
        np.add.at(self.counts, at, counts)
        np.add.at(self.sums, at, counts[:, None] * colors)
        return at

    def colors(self):
        """((light, dark), chosen): at most COLORS pairs of colors, each theme of shape (n, 3), uint8, and which of them
        stands for each number.
        """
        chosen = _grouped(self.sums / self.counts[:, None], self.counts, COLORS)
        weights = np.bincount(chosen, self.counts)[:, None]
        mean = np.stack([np.bincount(chosen, sums) for sums in self.sums.T], -1) / weights
        mean = mean.round().astype(np.uint8)
        return (mean[:, :3], mean[:, 3:]), chosen.astype(np.uint8)


def _packed(colors):
    """Colors, shape (..., 6), as one number each."""
    return sum(colors[..., k].astype(np.int64) << shift for k, shift in enumerate((40, 32, 24, 16, 8, 0)))


def _unpacked(keys):
    return np.stack([(keys >> shift) & 255 for shift in (40, 32, 24, 16, 8, 0)], -1)


def _grouped(points, weights, count):
    """Groups 0, 1, ... of points, shape (n, d), at most `count`: again and again the group that is widest, counted with
    the roots of its weights, is cut through its mean.
    """
    group, weights = np.zeros(len(points), int), np.sqrt(weights)
    spreads = [_spread(points, weights)]
    for new in range(1, count):
        widest = int(np.argmax([spread for spread, _ in spreads]))
        spread, axis = spreads[widest]
        if spread == 0:
            break
        members = np.flatnonzero(group == widest)
        along = points[members, axis]
        group[members[along > np.average(along, weights=weights[members])]] = new
        spreads[widest] = _spread(points[group == widest], weights[group == widest])
        spreads.append(_spread(points[group == new], weights[group == new]))
    return group


def _spread(points, weights):
    """The largest weighted sum of squares about the mean, and its axis."""
    mean = np.average(points, axis=0, weights=weights)
    squares = weights @ (points - mean) ** 2
    axis = int(squares.argmax())
    low, high = points[:, axis].min(), points[:, axis].max()
    return (float(squares[axis]) if high > low else 0.0), axis
