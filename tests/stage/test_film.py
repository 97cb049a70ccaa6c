"""A film shows what its Stage shows: same pictures in both themes, same words, same numbers of what lies in space."""

import base64
import json
import zlib

import numpy as np
import pytest

from labkit.stage import Choice, Handle, Play, Slider, Stage, film, living, style
from labkit.stage import scene3d_solids as solids
from labkit.stage.scene3d import Scene, View
from labkit.stage.scene3d_handles import Along


def compute(state):
    if state["P"][0] > 9.0:
        raise ValueError("P must stay left of 9")
    return {"P": state["P"], "size": state["size"], "t": state["t"], "wide": state["width"] == "wide"}


def stage(**changes):
    def scene(fig):
        ax = style.axes(fig.subplots(), "x (mm)", "y (mm)")
        ax.set(xlim=(0, 10), ylim=(0, 6))
        (line,) = ax.plot([], [], **style.look("estimate"))
        (dot,) = ax.plot([], [], **style.look("measurement"))

        def update(state, result):
            line.set_data([0, result["P"][0]], [result["t"], result["P"][1]])
            line.set_linewidth(6 if result["wide"] else 2)
            dot.set_data([state["Q"][0]], [state["Q"][1]])
            dot.set_markersize(result["size"])

        return [line, dot], update

    options = {
        "handles": {"P": Handle((5, 3)), "Q": Handle((2, 2), color=style.MEASUREMENT)},
        "controls": {"size": Slider(2, 12, 6, label="size (mm)"), "width": Choice(["thin", "wide"], "thin")},
        "play": Play(t_max=4.0, dt=0.1, start=1.0),
        "fail": {"P": (8, 5)},
        "describe": lambda result: f"P at {result['P'][0]:.2f}, t = {result['t']:.1f}",
    }
    return Stage("a line", scene=scene, compute=compute, **{**options, **changes})


@pytest.fixture(scope="module", autouse=True)
def small():
    """Small films, so that the tests are quick."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in {"ROOM": 240, "AROUND": 12, "PLAYED": 20, "FAILED": 4}.items():
            patch.setattr(film, name, value)
        yield


def test_a_film_invites_to_nothing_that_it_does_not_answer():
    words = f"Look{living(', or click the picture', ' closely')}."

    def empty(fig):
        return fig.subplots().plot([0], [0]), lambda state, result: None

    invites = Stage("a line", scene=empty, compute=dict, fail={}, describe=lambda _: words)
    notes = [note for track in film.record(invites).tracks.values() for note in track.notes]
    assert {note["caption"] for note in notes} == {"Look closely."}
    assert invites.caption == "Look, or click the picture."


@pytest.fixture(scope="module")
def used():
    return stage()


@pytest.fixture(scope="module")
def recorded(used):
    return film.record(used)


def picture(recorded, name, number, dark):
    """A picture of a film, taken from what is stored, in colors."""
    width, height = recorded.size
    stored = np.frombuffer(zlib.decompress(recorded.tracks[name].reel), np.uint8).reshape(-1, height, width)
    index = np.bitwise_xor.reduce(stored[: number + 1], axis=0)
    return recorded.palettes[dark][index].astype(int)


def test_pictures_and_words_are_those_of_the_stage(recorded):
    living = stage()
    living.connect(lambda message, buffers: None)
    room = {"width": film.ROOM, "height": 4 * film.ROOM, "ratio": film.RATIO, "dark": False}
    living.receive({"look": room})
    for name, number, changes in (
        ("start", 0, {}),
        ("control", 10, {"size": 12}),
        ("play", 20, {"t": 4.0}),
        ("Make it fail", 0, {"P": (8, 5), "t": 0.0}),
    ):
        living.reset()
        living.set(**changes)
        for dark, pixels in enumerate(living.in_both_themes()):
            off = np.abs(picture(recorded, name, number, dark) - pixels[..., :3].astype(int)).max(-1)
            assert off.mean() < 0.5 and (off > 32).mean() < 1e-3, (name, dark)
        assert recorded.tracks[name].notes[number]["caption"] == living.caption


def test_the_first_handle_goes_around_and_the_note_says_where(recorded):
    notes = recorded.tracks["handle"].notes
    places = np.array([note["handles"]["P"]["at"] for note in notes])
    living = stage()
    living._picture.fit(film.ROOM, 4 * film.ROOM, film.RATIO, False)
    living.png()  # it is laid out
    axes = living.figure.axes[0]
    for note, place in zip(notes[::3], places[::3]):
        x = axes.transData.inverted().transform(
            place * [1, -1] * living.figure.bbox.size + [0, living.figure.bbox.height]
        )
        told = float(note["caption"].split()[2].rstrip(","))
        assert abs(told - x[0]) < 0.02
    assert (np.ptp(places, axis=0) > 0.15).all() and len(np.unique(places, axis=0)) == film.AROUND
    assert list(recorded.declaration["handles"]) == ["P"] and "Q" not in notes[0]["handles"]


def test_a_control_is_numbered_by_what_was_recorded(recorded):
    notes, declared = recorded.tracks["control"].notes, recorded.declaration["controls"]
    assert declared["size"]["positions"] == len(notes) - 1 == 10 and list(declared) == ["size"]
    assert [note["controls"]["size"]["at"] for note in notes] == list(range(11))
    assert [note["controls"]["size"]["text"] for note in notes] == [str(k) for k in range(2, 13)]
    start = recorded.tracks["start"].notes[0]["controls"]["size"]
    assert start == notes[recorded.tracks["control"].entry]["controls"]["size"] == {"at": 4, "text": "6"}


def test_time_is_numbered_by_what_was_recorded(recorded):
    play, failing = recorded.tracks["play"], recorded.tracks["Make it fail"]
    for track in (play, failing):
        assert [note["time"]["at"] for note in track.notes] == list(range(len(track.notes)))
    assert recorded.declaration["play"]["steps"] == len(play.notes) - 1
    assert play.notes[play.entry]["time"]["text"] == "t = 1.00 s"


def test_a_handle_that_goes_one_way_is_led_to_and_fro_and_one_that_stays_is_left_out():
    handles = {"Q": Handle((2, 2), bounds=((2, 2), (2, 2))), "P": Handle((5, 3), bounds=((1, 10), (3, 3)))}
    made = film.record(
        stage(handles=handles, controls={"width": Choice(["thin", "wide"], "thin"), "size": Slider(2, 12, 6)})
    )
    assert list(made.declaration["handles"]) == ["P"]
    assert {note["status"] for note in made.tracks["handle"].notes} == {"", "P must stay left of 9"}
    places = np.array([note["handles"]["P"]["at"] for note in made.tracks["handle"].notes])
    assert np.ptp(places[:, 0]) > 0.4 and np.ptp(places[:, 1]) < 1e-3
    assert [note["controls"]["width"]["text"] for note in made.tracks["control"].notes] == ["thin", "wide"]


def test_a_phone_has_a_film_laid_out_for_it_with_fewer_pictures(recorded):
    made = film.record(stage(), narrow=True)
    assert made.narrow and not recorded.narrow
    assert made.size[0] <= film.PHONE * film.RATIO and set(made.tracks) == set(recorded.tracks)
    assert len(made.tracks["handle"].notes) == len(recorded.tracks["handle"].notes) / film.SPARSER
    assert made.declaration["controls"].keys() == recorded.declaration["controls"].keys()


def test_the_stage_is_at_its_start_again(used, recorded):
    assert {key: np.array(value).tolist() for key, value in used.state.items()} == {
        key: np.array(value).tolist() for key, value in used.initial.items()
    }


@pytest.mark.parametrize("seed", range(3))
def test_few_colors_are_kept_as_they_are_and_many_are_grouped_near(seed):
    rng = np.random.default_rng(seed)
    flat = rng.integers(0, 256, (200, 6)).astype(float)
    assert len(np.unique(film._grouped(flat, rng.uniform(1, 1e5, 200), 256))) == len(np.unique(flat, axis=0))
    ramp = np.linspace(0, 255, 4000)[:, None] * np.ones(6)
    group = film._grouped(ramp, np.ones(4000), 256)
    assert max(np.ptp(ramp[group == k, 0]) for k in range(256)) < 4


def in_space():
    """A ball on a handle, another that is hidden while it is low, and words."""

    def scene(fig):
        space = Scene(fig.subplots(), radius=10)
        ball, other = space.body(solids.sphere(1.0)), space.body(solids.sphere(2.0))
        words = space.text("")

        def update(state, result):
            for body, x in ((ball, 0.0), (other, 1 / 3)):
                T = np.eye(4)
                T[:3, 3] = x, 0.7, state["P"][2]
                body.set(T)
            other.show(state["P"][2] > 0)
            words.set(state["P"], f"{state['P'][2]:.0f}")
            space.draw(state["view"])

        return space.artists, update

    up = Handle((0, 0.7, 1.0), way=Along((0, 0, 1)), bounds=((0, 0), (0.7, 0.7), (-5, 5)))
    return Stage(
        "balls", scene=scene, compute=lambda state: None, handles={"P": up}, fail={"P": (0, 0.7, 5)}, view=View()
    )


def test_what_lies_in_space_is_kept_as_numbers_and_turns_freely():
    made = film.record(in_space())
    data = json.loads(json.dumps(made.as_data()))
    assert set(made.tracks) == {"start", "handle", "Make it fail"} and made.declaration["empty"] == "turn"
    raw = np.frombuffer(zlib.decompress(base64.b64decode(data["space"]["numbers"])), np.uint8)
    numbers = np.split(raw.reshape(4, -1).T.copy().view("<f4").ravel(), np.cumsum(data["space"]["counts"])[:-1])
    heights = []
    for note in made.tracks["handle"].notes:
        ball, other, words, path = note["things"][0]
        x, y, z = note["handles"]["P"]["point"]
        assert numbers[ball].reshape(4, 4)[:3, 3] == pytest.approx([0, y, z], rel=1e-4, abs=1e-6)
        assert (other == -1) == (z <= 0)
        assert other == -1 or numbers[other].reshape(4, 4)[0, 3] == pytest.approx(1 / 3, rel=1e-4)
        assert data["space"]["words"][words] == f"{z:.0f}"
        assert numbers[path].reshape(-1, 3)[:, 2].max() == pytest.approx(
            max(p["handles"]["P"]["point"][2] for p in made.tracks["handle"].notes), rel=1e-4
        )
        heights.append(z)
    assert np.ptp(heights) > 4
    assert len(made.declaration["spaces"][0]["items"]) == 4  # with the path on which the handle was led


def test_the_pictures_of_a_scene_in_space_hold_nothing_of_it():
    made = film.record(in_space())
    first, last = (picture(made, "handle", k, False) for k in (0, len(made.tracks["handle"].notes) // 2))
    assert np.array_equal(first, last)
