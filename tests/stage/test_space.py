"""Scenes in space without a browser: what is described, which numbers travel, how handles move, what is refused."""

import hashlib
import json
import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

from labkit.stage import Handle, Slider, Stage, front, style
from labkit.stage import scene3d_solids as solids
from labkit.stage.scene3d import Scene, View
from labkit.stage.scene3d_handles import Along, Dial, Free, OnPlane, OnSphere, stepped

LOOK = {"width": 600, "height": 400, "ratio": 1, "dark": False, "letters": 1.0}
VIEW = View(-40, 30, center=(1, 2, 3), eye=60.0, zoom=1.4)


def posed(x, y, z, turn=(0, 0, 0)):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.from_rotvec(turn).as_matrix(), (x, y, z)
    return T


def cell(**options):
    """A box that goes up, a ball that only shows above 1, a path, and a joint to turn."""

    def scene(fig):
        space = Scene(fig.subplots(), radius=10, floor=-1.0, unit="mm")
        base = space.fixed(space.triad("B", 2), np.eye(4))
        box, ball = space.body(solids.box(2, 2, 2), name="box"), space.body(solids.sphere(1.0), name="ball")
        path = space.line(**style.look("truth"))

        def update(state, result):
            box.set(posed(0, 0, state["up"]))
            ball.show(state["up"] > 1)
            ball.set(posed(3, 0, result))
            path.set([(0, 0, 0), (np.nan,) * 3, (0, 0, state["up"])])
            space.draw(state["view"])

        assert base.value is not None
        return space.artists, update

    return Stage("cell", **{
        "scene": scene, "compute": lambda state: state["up"], "fail": {"up": 4.0}, "view": VIEW,
        "controls": {"up": Slider(0.0, 5.0, 0.5, step=0.5)},
        "handles": {
            "P": Handle((1, 1, 1), way=Along((0, 0, 1))),
            "turn": Dial(10, -170, 170, lambda result: (posed(0, 0, 2), 3.0), label="joint"),
        },
        **options,
    })  # fmt: skip


def wired(stage, **look):
    sent = []
    stage.connect(lambda message, buffers: sent.append((json.loads(json.dumps(message)), buffers)))
    stage.receive({"look": {**LOOK, **look}, "serial": "a:1"})
    return stage, sent


def rows(message):
    return {number: (shown, count) for number, shown, count, _ in message["space"]["rows"][0]}


# -- what travels


def test_bodies_are_described_once_and_only_changed_numbers_travel():
    stage, sent = wired(cell(), space=True)
    declared = json.loads(json.dumps(stage.declaration()))["spaces"][0]
    kinds = [item["kind"] for item in declared["items"]]
    assert kinds == ["path", "triad", "body", "body", "path"]  # the first is the floor's grid
    box, ball, path = 2, 3, 4
    message, buffers = sent[-1]
    assert set(rows(message)) == set(range(5)) and rows(message)[ball] == (0, 0)
    numbers = np.frombuffer(buffers[-1], "<f4")
    assert len(numbers) == sum(count for _, count in rows(message).values())
    stage.receive({"control": {"up": 4}, "serial": "a:2"})  # up = 2.0
    message, buffers = sent[-1]
    assert set(rows(message)) == {box, ball, path} and rows(message)[ball] == (1, 16)
    numbers = np.frombuffer(buffers[-1], "<f4")
    assert numbers[:16].reshape(4, 4) == pytest.approx(posed(0, 0, 2))
    assert numbers[16:32].reshape(4, 4) == pytest.approx(posed(3, 0, 2))
    assert numbers[32:41].reshape(3, 3)[2] == pytest.approx([0, 0, 2])
    stage.receive({"control": {"up": 4}, "serial": "a:3"})
    assert sent[-1][0]["space"]["rows"] == [[]] and len(sent[-1][1][-1]) == 0  # nothing changed


def test_a_page_without_webgl_gets_the_picture_and_no_numbers():
    stage, sent = wired(cell())
    assert sent[-1][0]["space"] is None
    painted = stage.png()
    stage.receive({"look": {**LOOK, "space": True}, "serial": "a:2"})
    assert sent[-1][0]["space"] is not None
    assert stage.png() == painted  # files show the scene whoever draws it in the page


def test_the_drawing_is_sent_when_a_page_asks_and_costs_less_than_150_kB():
    stage, sent = wired(cell())
    stage.receive({"need": "space"})
    message, (source,) = sent[-1]
    assert message == {"module": "space"} and b"twgl" in source[:200] and 20_000 < len(source) < 150_000


def test_the_first_scene_of_a_kernel_brings_the_drawing_along(monkeypatch):
    monkeypatch.setattr(front.Front, "is_sent", False)
    flat = Stage("flat", scene=lambda fig: ([], lambda state, result: None), compute=dict, fail={}, size=(2, 2))
    brought = [front.widget(stage).drawing for stage in (flat, cell(), cell())]
    assert brought == [b"", front.SPACE.read_bytes(), b""]


def test_the_drawing_is_made_of_its_sources_as_they_are():
    """Else: cd web/space && npm install --no-package-lock && npm run build."""
    folder = Path(__file__).parents[2] / "web" / "space"
    names = ("build.mjs", "package.json", "renderer.js", "solids.js", "space.js", "world.js")
    assert sorted(path.name for path in folder.glob("*.*js*")) == sorted(names)
    sources = "".join((folder / name).read_text(encoding="utf-8") for name in names)
    made_of = re.search(r"Sources: (\w+)", front.SPACE.read_text(encoding="utf-8").splitlines()[0])[1]
    assert made_of == hashlib.sha256(sources.encode()).hexdigest()


def test_the_page_knows_the_home_view_wherever_one_has_turned_before_it_was_opened():
    stage, _ = wired(cell(), space=True)
    stage.receive({"view": {"angles": [40, 10], "zoom": 2.0, "center": [1, 0, 0]}})
    assert stage.declaration()["home"] == VIEW.describe() != stage.state["view"].describe()


def test_turning_needs_no_picture_and_python_learns_of_it():
    stage, sent = wired(cell(), space=True)
    before, stored = len(sent), stage.still()
    stage.receive({"view": {"angles": [400, 95], "zoom": 2.0, "center": [1, 0, 0]}})
    assert len(sent) == before
    assert stage.still() != stored  # tomorrow's picture is what one looked at
    assert stage.state["view"] == View(40, 90, center=(1, 0, 0), eye=60.0, zoom=2.0)
    stage.receive({"view": {"angles": [None, 0], "zoom": 2.0, "center": [1, 0, 0]}})  # JSON's NaN: kept as it was
    assert stage.state["view"].azimuth_deg == 40
    stage.receive({"button": "Reset", "serial": "a:2"})
    assert sent[-1][0]["space"]["view"] == VIEW.describe()  # the page goes home as well


# -- what is refused


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ((np.full((4, 4), np.nan),), "not finite"),
        ((np.eye(3),), r"shape \(3, 3\)"),
        ((np.full((4, 4), 1e39),), r"1e\+18 or more"),  # no number of the page's
    ],
)
def test_a_pose_that_is_none_is_named(values, sentence):
    space = Scene(Figure().subplots(), radius=10)
    with pytest.raises(ValueError, match="the lid: a pose must be.*" + sentence):
        space.body(solids.sphere(1.0), name="the lid").set(*values)
    with pytest.raises(ValueError, match="the frame K.*" + sentence):
        space.triad("K").set(*values)


def test_a_pose_that_becomes_nan_is_told_and_the_last_good_one_stays():
    def scene(fig):
        space = Scene(fig.subplots(), radius=10)
        lid = space.body(solids.sphere(1.0), name="the lid")

        def update(state, result):
            lid.set(posed(0, 0, np.nan if state["up"] > 1 else 1.0))
            space.draw(state["view"])

        return space.artists, update

    stage, sent = wired(cell(scene=scene, handles={}), space=True)
    stage.receive({"control": {"up": 4}, "serial": "a:2"})
    assert "the lid" in sent[-1][0]["status"] and sent[-1][0]["space"]["rows"] == [[]]


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e39])
def test_an_ellipsoid_or_a_joint_that_cannot_be_drawn_is_told_and_the_page_gets_numbers_alone(bad):
    def scene(fig):
        space = Scene(fig.subplots(), radius=10)
        round_, point = space.ellipsoid(), space.points(marker="o")

        def update(state, result):
            round_.set((0, 0, 0), np.diag([1, 1, bad if state["up"] == 2 else 1]))
            point.set((bad if state["up"] == 3 else 0, 0, 0))
            space.draw(state["view"])

        return space.artists, update

    joint = Dial(10, -170, 170, lambda up: (posed(0, 0, bad if up == 4 else 1), 3.0), label="joint")
    stage, sent = wired(cell(scene=scene, handles={"turn": joint}), space=True)
    start = stage.result
    for up, sentence in ((2, "an ellipsoid"), (3, ""), (4, "the circle of joint: a pose must be")):
        stage.receive({"control": {"up": 2 * up}, "serial": f"a:{up}"})
        message, buffers = sent[-1]
        assert message["serial"] == f"a:{up}" and message["status"].startswith(sentence)
        json.dumps(message, allow_nan=False)
        assert bool(message["status"]) == bool(sentence)
        stage.png()
    stage.receive({"button": "Reset", "serial": "a:9"})
    assert stage.result == start and stage.status == ""


def test_a_body_update_never_mentions_is_named_when_the_stage_is_built():
    def scene(fig):
        space = Scene(fig.subplots(), radius=10)
        space.body(solids.sphere(1.0), name="the lid")
        return space.artists, lambda state, result: space.draw(state["view"])

    with pytest.raises(ValueError, match="gives no place to the lid"):
        cell(scene=scene)


# -- the eye


def test_a_ray_goes_through_what_is_seen_there():
    points = np.array([(0, 0, 0), (3, -2, 5), (-4, 4, 1.0)])
    for view in (VIEW, View(-40, 30, center=(1, 2, 3))):
        for point in points:
            eye, ray = view.ray(*view.project(point)[:2])
            assert np.cross(point - eye, ray) == pytest.approx(np.zeros(3), abs=1e-9)


def test_near_things_are_larger_by_the_ratio_of_distances():
    view = View(0, 0, eye=10.0)  # the eye on +x
    far, near = view.project([(-10.0, 1, 0), (5.0, 1, 0)])
    assert far[0] == pytest.approx(0.5) and near[0] == pytest.approx(2.0)


# -- handles


START, ON_SCREEN = np.array([0.5, 1.0, 2.0]), 0.7 * VIEW.axes[0] - 0.4 * VIEW.axes[1]


@pytest.mark.parametrize(
    ("way", "goal"),
    [
        (Free(), START + ON_SCREEN),
        (Along((1, 1, 0)), START + (0.6, 0.6, 0)),
        (OnPlane((0, -0.6, 0.8)), START + (0.5, 0.8, 0.6)),
        (OnSphere(3.0), OnSphere(3.0).keep(START + VIEW.axes[2] * 3)),
        (OnSphere(3.0, upper=True), OnSphere(3.0).keep(START + VIEW.axes[2] * 3)),
    ],
)
def test_a_pull_ends_where_one_points_as_far_as_the_way_allows(way, goal):
    at = way.keep(START)
    eye, ray = VIEW.ray(*VIEW.project(goal)[:2])
    assert way.pull(at, eye, ray, VIEW.axes[2]) == pytest.approx(goal, abs=1e-9)


def test_a_ray_past_the_sphere_pulls_to_its_edge():
    way = OnSphere(1.0)
    eye, ray = View(0, 0).ray(3.0, 0.0)
    assert way.pull(np.array([1.0, 0, 0]), eye, ray, View(0, 0).axes[2]) == pytest.approx([0, 1, 0])


def test_arrow_keys_follow_the_axes_of_the_world():
    axes = View(-80, 20).axes  # right is nearly +x, up nearly +z
    at = np.array([1.0, 2, 3])
    assert stepped(Free(), at, (2, 0), axes, 0.5) == pytest.approx(at + [1, 0, 0])
    assert stepped(Free(), at, (0, -1), axes, 0.5) == pytest.approx(at - [0, 0, 0.5])
    assert stepped(Along((0, 1, 0)), at, (0, 1), axes, 1.0) == pytest.approx(at + [0, 1, 0])  # away is up on the screen
    assert stepped(OnSphere(2.0), np.array([2.0, 0, 0]), (0, 1), axes, 0.5) == pytest.approx(
        2 * np.array([2, 0, 0.5]) / np.hypot(2, 0.5)
    )


def test_a_handle_with_a_way_keeps_its_bounds_however_it_is_moved():
    stage, _ = wired(cell(handles={"P": Handle((1, 1, 1), way=Free(), bounds=((0, 2), (0, 2), (1, 1)))}), space=True)
    for message in ({"drag": {"P": (0.9, 0.1)}}, {"step": {"P": (90, 90)}}, {"drag": {"P": (0.1, 0.9)}}):
        stage.receive({**message, "serial": "a:2"})
        assert (stage.state["P"] >= (0, 0, 1)).all() and (stage.state["P"] <= (2, 2, 1)).all()
    assert not np.array_equal(stage.state["P"], (1, 1, 1))


def test_a_dial_follows_the_pointer_and_ends_at_its_limits():
    stage, _ = wired(cell(), space=True)
    ax = stage.figure.axes[0]
    for angle in (-60.0, 35.0, 120.0):
        point = [3 * np.cos(np.deg2rad(angle)), 3 * np.sin(np.deg2rad(angle)), 2]
        stage.receive({"drag": {"turn": stage._picture.fraction(ax, VIEW.project(point)[:2])}, "serial": "a:2"})
        assert stage.state["turn"] == pytest.approx(angle, abs=0.5)
    stage.receive({"step": {"turn": (70, 0)}, "serial": "a:3"})
    assert stage.state["turn"] == 170
    with pytest.raises(ValueError, match="turn must lie in"):
        stage.set(turn=200.0)


# -- solids


@pytest.mark.parametrize(
    ("solid", "volume"),
    [
        (solids.box(2, 3, 4), 24.0),
        (solids.cylinder(1.0, 0.0, 2.0), 2 * 12 / 2 * np.sin(np.pi / 6)),  # a prism of twelve sides
        (solids.cylinder(1.0, 0.0, 3.0, 0.0), 12 / 2 * np.sin(np.pi / 6)),
        (solids.raised([(0, 0), (1, 0), (0, 1)], 0.0, 2.0), 1.0),
    ],
)
def test_solids_are_closed_and_look_outward(solid, volume):
    """By the divergence theorem: the sum over triangles is the volume only if each shows its outside."""
    for T in (np.eye(4), posed(5, -3, 2, (0.3, 0.7, -0.2))):
        a, b, c = np.moveaxis(solid.moved(T).triangles(), 1, 0)
        assert np.einsum("ni,ni", a, np.cross(b, c)) / 6 == pytest.approx(volume, rel=1e-3)


def test_a_rod_reaches_from_end_to_end():
    T = solids.between((1, 2, 3), (4, 6, 3), 0.5)
    assert pytest.approx([1, 2, 3, 1]) == T @ [0, 0, 0, 1] and pytest.approx([4, 6, 3, 1]) == T @ [0, 0, 1, 1]
    assert np.linalg.det(T[:3, :3]) == pytest.approx(0.25 * 5)
