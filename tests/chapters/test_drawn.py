"""What is drawn is what is meant: vertices of the artists beside closed forms and results, chapters 1 to 9 and 11.

One mechanism: `drawn` reads the vertices of all moving lines, `assert_drawn` wants one of them to hold exactly the
expected ones, projected first where the Stage shows space.
"""

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import PcolorImage
from matplotlib.lines import Line2D
from matplotlib.patches import Wedge
from matplotlib.text import Annotation, Text
from scipy.spatial.transform import Rotation

from labkit.chapters.ch01_frames import stages as ch01
from labkit.chapters.ch02_chaining import stages as ch02
from labkit.chapters.ch03_quirlen import stages as ch03
from labkit.chapters.ch04_optimization import stages as ch04
from labkit.chapters.ch05_hand_eye import stages as ch05
from labkit.chapters.ch06_tracker import figures as ch06_figures
from labkit.chapters.ch06_tracker import stages as ch06
from labkit.chapters.ch06_tracker import whole_cell
from labkit.chapters.ch07_dead_reckoning import stages as ch07
from labkit.chapters.ch08_kalman import stages as ch08
from labkit.chapters.ch09_monte_carlo import stages as ch09
from labkit.chapters.ch11_your_own_data import stages as ch11
from labkit.documents.lecture.examples import load_building
from labkit.documents.thesis import wells
from labkit.machines import simulation, udp
from labkit.machines.arm import TX40, link_frames
from labkit.machines.packet import POSITION, decode_packet
from labkit.machines.sensor_cell import CELL
from labkit.stage import Stage
from labkit.stage.scene3d import Scene
from labkit.stage.scene3d_handles import Dial

GAP = [np.nan, np.nan]


def drawn(stage):
    """Vertices (n, 2) of every moving line of a Stage, as its axes hold them."""
    lines = (a for a in stage.moving if isinstance(a, Line2D) and a.get_visible())
    return [vertices for line in lines if len(vertices := line.get_xydata())]


def assert_drawn(stage, *expected):
    """One moving line holds each of the expected rows of vertices, (n, 2), or (n, 3) of a scene in space."""
    found = drawn(stage)
    for points in expected:
        points = np.asarray(points, dtype=float)
        if points.shape[-1] == 3:
            points = stage.state["view"].project(points)[:, :2]
        scale = np.nanmax(np.abs(points)) + 1
        alike = [v for v in found if v.shape == points.shape]
        assert any(np.allclose(v, points, rtol=0, atol=1e-9 * scale, equal_nan=True) for v in alike), points


def assert_along(stage, name, start, end):
    """A slender body reaches from one point to another, and lies around the line between them."""
    corners = stage.spaces[0].named(name).corners().reshape(-1, 3) - start
    length = np.linalg.norm(np.subtract(end, start))
    along = np.subtract(end, start) / length
    reach = corners @ along
    assert [reach.min(), reach.max()] == pytest.approx([0.0, length], abs=1e-6 * length)
    off = np.linalg.norm(corners - np.outer(reach, along), axis=1)
    assert off[reach < 1e-6 * length].max() < 1e-6 * length  # it starts in a tip
    assert off.max() < 0.15 * length


def at(stage, **changes):
    stage.set(**changes)
    assert not stage.status
    return stage


def plane(angle_deg):
    """The rotation of the plane, (2, 2)."""
    return Rotation.from_euler("z", angle_deg, degrees=True).as_matrix()[:2, :2]


# --- handles ----------------------------------------------------------------------------------------------------------

WITH_HANDLES = (
    ch01.three_points, ch01.triangle_noise, ch01.svd_against_gram_schmidt, ch02.order_of_product, ch02.open_loop,
    ch03.pose_designer, ch03.outliers, ch04.line, ch04.four_paths, ch04.saddle, ch04.convexity,
    ch04.basins, ch05.triangle, ch05.scan_line,
    ch05.convergence, ch05.two_methods, ch05.pattern_designer, ch05.accuracy_kinds,
    ch06.tx40, ch06.two_axes, ch06.sweeps, ch06.whole_cell,
    ch02.two_loops, ch05.difference_steps, ch07.circles, ch08.bells, ch08.vehicle, ch08.arena,
)  # fmt: skip


def gaps(stage):
    """How far each handle is from the nearest drawn vertex or name of its axes, as a share of their width."""
    artists = stage.moving
    for key, handle in stage.handles.items():
        place, ax = stage.state[key], stage.figure.axes[handle.ax]
        place = handle.point(place, stage.result) if isinstance(handle, Dial) else place
        here = stage.state["view"].project(place)[:2] if len(place) == 3 else place
        lines = [a.get_xydata() for a in artists if isinstance(a, Line2D) and a.axes is ax and len(a.get_xydata())]
        names = [np.array([a.xy]) for a in artists if isinstance(a, Annotation) and a.axes is ax]
        distances = [np.linalg.norm(v - here, axis=1) for v in (*lines, *names)]
        yield key, np.nanmin(np.concatenate(distances)) / abs(np.subtract(*ax.get_xlim()))


@pytest.mark.parametrize("make", WITH_HANDLES, ids=lambda make: f"{make.__module__.split('.')[2]}.{make.__name__}")
def test_every_handle_lies_on_what_it_moves(make):
    """At the start, made to fail, and moved: less than a pixel away, for circles are drawn as polygons."""
    stage = make()
    for change in (lambda stage: None, Stage.make_it_fail, move_all):
        change(stage)
        assert max(gap for _, gap in gaps(stage)) < 1e-3, change.__name__
        stage.reset()


def move_all(stage):
    for key, handle in stage.handles.items():
        width = abs(np.subtract(*stage.figure.axes[handle.ax].get_xlim()))
        stage.set(**{key: stage.state[key] - 0.03 * width})


def assert_rod(stage, name, start, end):
    """A rod reaches from one point to another, everywhere as far from the line between them or on it."""
    corners = stage.spaces[0].named(name).corners().reshape(-1, 3) - start
    length = np.linalg.norm(np.subtract(end, start))
    along = np.subtract(end, start) / length
    reach = corners @ along
    off = np.linalg.norm(corners - np.outer(reach, along), axis=1)
    assert [reach.min(), reach.max()] == pytest.approx([0.0, length], abs=1e-6 * length)
    assert off[off > 1e-6 * length] == pytest.approx(off.max())


# --- chapter 1 --------------------------------------------------------------------------------------------------------


def test_three_points_draw_their_construction():
    O0, X0, Y0 = np.array([0.5, 0.4, 0.2]), np.array([2.1, 1.6, 0.2]), np.array([0.3, 2.4, 0.2])
    stage = at(ch01.three_points(), O0=O0, X0=X0, Y0=Y0)
    x = (X0 - O0) / 2.0  # 1.6, 1.2: 2 long
    y = np.array([-0.6, 0.8, 0.0])
    foot = O0 + x * (x @ (Y0 - O0))
    assert_drawn(stage, [X0, O0, Y0], [O0, foot], [foot], [foot, Y0], [O0, O0 + 0.7 * x], [O0, O0 + 0.7 * y])
    plane = stage.spaces[0].named("K0").corners().reshape(-1, 3)
    assert plane[:, 2] == pytest.approx(0.2)  # all three points lie in it
    plate = stage.spaces[0].named("triangle of K0").corners().reshape(-1, 3)
    for corner in (O0, X0, Y0):
        assert np.linalg.norm(plate - corner, axis=1).min() == pytest.approx(0.006)  # half its thickness


def test_noisy_triangle_and_its_frame():
    stage = at(ch01.triangle_noise(), Y=(20.0, 45.0, 0.0))
    assert_drawn(stage, [[0, 0, 0], [100, 0, 0], [20, 45, 0], [0, 0, 0]], *([[0, 0, 0], e] for e in 60.0 * np.eye(3)))
    plate = stage.spaces[0].named("plate").corners().reshape(-1, 3)
    for corner in ([0, 0], [100, 0], [20, 45]):
        here = plate[(np.abs(plate[:, :2] - corner) < 1e-9).all(1)]
        assert sorted({round(z, 9) for z in here[:, 2]}) == pytest.approx([-0.3, 0.3])
    first = stage.result["T"][:, :3, 3] + 60.0 * stage.result["T"][:, :3, 0]
    assert_drawn(stage, first)


def test_gimbal_draws_the_frame_of_the_angles():
    stage = at(ch01.kuka_gimbal(), A_deg=30, B_deg=50, C_deg=-70)
    R = Rotation.from_euler("ZYX", [30, 50, -70], degrees=True).as_matrix()
    assert_drawn(stage, *([np.zeros(3), 0.58 * axis] for axis in R.T))
    hand = stage.spaces[0].named("hand").corners().reshape(-1, 3) @ R  # seen from the frame it stands for
    assert [hand[:, 0].max(), hand[:, 2].min(), hand[:, 2].max()] == pytest.approx([0.32, -0.1, 0.1])
    turned = np.deg2rad(np.linspace(0, 30, 25))
    assert_drawn(stage, np.column_stack([np.cos(turned), np.sin(turned), 0 * turned]))  # the arc of A, radius 1


def test_both_constructions_stand_on_the_triangle():
    stage = at(ch01.svd_against_gram_schmidt(), X=(80.0, 0.0), Y=(10.0, 70.0))
    measured = stage.result["measured"]
    assert_drawn(stage, [[0, 0], [80, 0], [10, 70], [0, 0]], measured.reshape(-1, 3)[:, :2])
    found = np.column_stack([np.arange(3) - 0.16, stage.result["gram_schmidt_deg"]])
    assert_drawn(stage, found)


# --- chapter 2 --------------------------------------------------------------------------------------------------------


def test_second_move_starts_in_the_frame_of_the_first():
    A, B = np.array([140.0, 20.0, 30.0]), np.array([-50.0, 110.0, 40.0])
    stage = at(ch02.order_of_product(), A=A, B=B, A_deg=50, B_deg=-35)
    RA, RB = (Rotation.from_euler(axis, deg, degrees=True).as_matrix() for axis, deg in (("z", 50), ("x", -35)))
    AB, BA = A + RA @ B, B + RB @ A
    assert_drawn(stage, [np.zeros(3), A, AB], [np.zeros(3), B, BA], [AB], [BA])
    assert_drawn(stage, *([AB, AB + 90 * axis] for axis in (RA @ RB).T), *([A, A + 70 * axis] for axis in RA.T))
    for space, end, R in zip(stage.spaces, (AB, BA), (RA @ RB, RB @ RA)):
        piece = (space.named("piece").corners().reshape(-1, 3) - end) @ R  # seen from the frame it is carried by
        assert piece.min(0) == pytest.approx(np.zeros(3), abs=1e-9) and piece.max(0) == pytest.approx([95, 70, 44])


@pytest.mark.parametrize(("link", "axis"), [(1, "z"), (2, "z"), (3, "x"), (4, "y"), (2, "y")])
def test_a_turned_link_opens_the_loop_about_its_end(link, axis):
    stage = at(ch02.open_loop(), link=link, turn_deg=8.0, axis=axis, K2=(-200.0, -300.0, 0.0))
    corners = [np.zeros(3), *(stage.state[f"K{k}"] for k in (1, 2, 3)), np.zeros(3)]
    about = Rotation.from_euler("z", ch02._sheet_angles()[0][link % 4]).as_matrix()[:, "xyz".index(axis)]
    turn = Rotation.from_rotvec(np.deg2rad(8.0) * about).as_matrix()
    after = [c if k <= link else corners[link] + turn @ (c - corners[link]) for k, c in enumerate(corners)]
    place = stage.state["P"]
    assert_drawn(stage, corners, after, [corners[link], after[-1]])
    assert_drawn(stage, corners[link] + np.outer([-110.0, 110.0], about))
    if link < 4:  # else it opens nothing at K0
        assert_rod(stage, "gap at K0", np.zeros(3), after[-1])
    assert_rod(stage, "gap at P", place, corners[link] + turn @ (place - corners[link]))


def test_laws_of_growth_are_the_sums_over_the_levers():
    """Each link turns all that follows: in a row about levers of 0, 300, 600 mm, on a loop about chords of 300 mm."""
    stage = at(ch02.growth(), std_rot_deg=0.5)
    std = np.deg2rad(0.5)

    def law(levers):
        return np.sqrt(3 * len(levers) * 0.1**2 + 2 * std**2 * np.sum(levers**2))

    numbers = np.array([1, 2, 4, 8, 16, 32, 64])
    row = [law(300.0 * np.arange(n)) for n in numbers]
    loop = [law(300.0 * np.sin(np.pi * np.arange(n) / n)) for n in numbers]
    assert_drawn(stage, np.column_stack([numbers, row]), np.column_stack([numbers, loop]))
    heights, frames = stage.result["heights"], np.arange(17)
    assert_drawn(stage, [row for run in heights.T for row in (*zip(frames, run), GAP)])
    std = np.array([np.sqrt(k * 0.1**2 + std**2 * np.sum((300.0 * np.arange(k)) ** 2)) for k in frames])
    assert_drawn(stage, [*zip(frames, std), GAP, *zip(frames, -std)])


def test_two_loops_are_magnified_about_the_true_corners():
    """Shared out by equal quarters: A's way ends where it began, each frame moved on by its share of the error."""
    stage = at(ch02.two_loops(), A=(-120.0, 60.0), B=(400.0, 300.0))
    corners = np.array([[0, 0], [400, 0], [400, 300], [0, 300], [0, 0], [800, 0], [800, 300.0]])
    measured_a = [*corners[:4], (-120, 60)]
    measured_b = [corners[1], *corners[5:], corners[2]]
    assert_drawn(stage, [*measured_a, GAP, *measured_b, GAP])
    assert_drawn(at(stage, way="as measured"), measured_a, measured_b, [(0, 0), (-120, 60)])
    left = at(stage, way="B, then A").result["left"]["B, then A"]
    assert_drawn(stage, [*upright((0.1,), left[:1]), *upright((1.1,), left[1:])])


# --- chapter 3 --------------------------------------------------------------------------------------------------------


def test_pose_designer_draws_its_directions_and_the_null_vector():
    stage = ch03.pose_designer()
    directions = np.array([stage.state[f"D{k}"] for k in range(1, 7)])
    assert_drawn(stage, directions)
    for k, direction in enumerate(directions, start=1):
        assert_along(stage, f"tool {k}", np.zeros(3), direction)
    stage.make_it_fail()  # all directions up, spun about themselves: the tip may slide along z
    assert_drawn(stage, [[0, 0, -1.15], [0, 0, 1.15]])


def test_swirling_tool_reaches_from_flange_to_pivot():
    stage = at(ch03.swirl(), std_trans=0.0, t=2.0)
    origin = stage.result["T"][:3, 3]
    assert np.linalg.norm(origin) == pytest.approx(100.0)  # the tip is 100 mm from the flange
    assert origin[2] == pytest.approx(100 * np.cos(np.deg2rad(25)))  # on a cone of 25 deg, the flange above
    tip = origin + stage.result["T"][:3, :3] @ [0, 0, -100]  # the measured one: 0.05 deg of noise move it 0.1 mm
    assert np.linalg.norm(tip) < 0.5
    assert_along(stage, "tool", tip, origin)
    assert_drawn(stage, [origin, origin + 35 * stage.result["T"][:3, 0]])


def test_outliers_are_crossed_out_where_they_were_dragged():
    stage = at(ch03.outliers(), **{"pose 2": (12.0, 9.0)})
    gone = stage.result["weights"] == 0
    touches = stage.result["touches"]
    assert gone[1] and touches[1] == pytest.approx([12.0, 9.0], abs=0.01)
    assert_drawn(stage, touches[~gone], touches[gone])


# --- chapter 4 --------------------------------------------------------------------------------------------------------


def test_parabola_touches_the_curve_and_its_vertex_is_the_next_iterate():
    stage = at(ch04.line(), start=(0.3, 0.0))
    t, h = stage.result["around"], 1e-4
    f = [float(wells.value(wells.on_line(at_))) for at_ in (0.3 - h, 0.3, 0.3 + h)]
    slope, bend = (f[2] - f[0]) / (2 * h), (f[2] - 2 * f[1] + f[0]) / h**2
    curve = next(v for v in drawn(stage) if v.shape == (61, 2))
    np.testing.assert_allclose(curve[:, 0], t)
    np.testing.assert_allclose(curve[:, 1], f[1] + slope * (t - 0.3) + 0.5 * bend * (t - 0.3) ** 2, atol=1e-3)
    iterates = stage.result["t"]
    assert iterates[1] == pytest.approx(0.3 - slope / bend, abs=1e-5)
    shown = np.clip(iterates, -0.6, 1.6)
    assert_drawn(stage, np.column_stack([shown, wells.value(wells.on_line(shown))]))


def test_step_and_radius_start_at_the_iterate():
    stage = at(ch04.four_paths(), k=1)
    x, step, radius = (stage.result[key] for key in ("x", "step", "radius"))
    run = wells.run("trust_region", stage.state["start"], max_iterations=12)
    assert_drawn(stage, run.x, [run.x[1], run.x[1] + run.step[1]], [x, x + step])
    rim = next(v for v in drawn(stage) if v.shape == (121, 2))
    np.testing.assert_allclose(np.linalg.norm(rim - x, axis=1), radius)
    inside = [v for v in drawn(stage) if np.isnan(v).any()]  # the contours of the model, around the iterate
    assert len(inside) == 1 and np.nanmin(inside[0][:, 0]) < x[0] < np.nanmax(inside[0][:, 0])


def test_newton_step_is_the_sum_of_its_shares():
    stage = at(ch04.saddle(), start=(0.5, 0.1))
    start = stage.state["start"]
    newton = -np.linalg.solve(wells.hessian(start), wells.gradient(start))
    shares = next(v for v in drawn(stage) if v.shape == (3, 2) and np.allclose(v[0], start))
    np.testing.assert_allclose(shares[2], start + newton, atol=1e-9)
    _, V = np.linalg.eigh(wells.hessian(start))
    assert abs((shares[1] - start) @ V[:, 1]) < 1e-9 * np.linalg.norm(newton)  # first along the lower curvature
    for direction in V.T:
        assert_drawn(stage, [start - 0.35 * direction, start + 0.35 * direction])


def test_path_over_the_basins_is_the_run():
    stage = at(ch04.basins(), start=(1.2, 1.1))
    assert_drawn(stage, np.clip(wells.run("newton", [1.2, 1.1], max_iterations=12).x, -50, 50))


# --- chapter 5 --------------------------------------------------------------------------------------------------------


def test_sphere_its_mirror_image_and_the_circle_of_the_scan():
    stage = at(ch05.scan_line(), C=(18.0, 245.0), std=0.01)
    radius = ch05.RADIUS
    turn = np.column_stack([np.cos(ch05.draw.CIRCLE), np.sin(ch05.draw.CIRCLE)])
    assert_drawn(stage, (18.0, 245.0) + radius * turn, (-18.0, 245.0) + radius * turn, stage.result["points"])
    circles = [v for v in drawn(stage) if v.shape == turn.shape]
    cut = circles[2]  # the circle in which the plane cuts the sphere, fitted to the points
    assert np.ptp(cut[:, 0]) / 2 == pytest.approx(np.sqrt(radius**2 - 18.0**2), abs=0.05)
    assert cut.mean(0)[1] == pytest.approx(245.0, abs=0.5)


def test_the_scanner_walks_from_the_start_to_where_it_sits():
    stage = at(ch05.convergence(), tilt=-2.0, yaw=20.0, step=2)
    truth = stage.result["truth"]
    turn = Rotation.from_rotvec([0.0, -2.0, 20.0], degrees=True).as_matrix()
    seen = truth[:3, 3] + 240.0 * (turn @ truth[:3, :3])[:, 2]  # the start, and where the walk ends:
    for name in ("euler", "se3"):
        run = stage.result[name]
        assert run["path"][0] == pytest.approx([-2.0, 20.0], abs=1e-9)
        assert run["seen"][0] == pytest.approx(seen)
        assert run["seen"][-1] == pytest.approx(truth[:3, 3] + 240.0 * truth[:3, 2], abs=1e-5)
        assert_drawn(stage, run["seen"], np.column_stack([np.arange(len(run["rms"])), run["rms"]]))
        box = stage.spaces[0].named(f"scanner of {name}").corners().reshape(-1, 3) - run["now"][:3, 3]
        assert np.abs(box @ run["now"][:3, :3]).max(0) == pytest.approx([75, 26, 90])  # of its own frame


def test_both_rays_meet_where_the_object_is():
    stage = at(ch05.triangle(), P=(30.0, 200.0), base=80)
    assert_drawn(stage, [[0, 0], [80, 0]], [[0, 0], [30, 200], [80, 0]], [[200, stage.result["std"]]])


def test_the_circle_of_repeatability_stands_around_the_mean_of_the_arrivals():
    stage = at(ch05.accuracy_kinds(), M=(-1.0, 0.5), around=True)
    reached = stage.result["reached"]
    distances = np.linalg.norm(reached - reached.mean(0), axis=1)
    angle = np.linspace(0, 2 * np.pi, 121)
    circle = reached.mean(0) + (distances.mean() + 3 * distances.std(ddof=1)) * np.column_stack(
        [np.cos(angle), np.sin(angle)]
    )
    assert_drawn(stage, circle, [[0, 0], reached.mean(0)], reached)


def test_both_methods_start_at_the_handle_and_what_is_taken_back_is_crossed():
    stage = at(ch05.two_methods(), P=(0.0, 175.0), B_deg=-88.0)
    for name, run in stage.result["runs"].items():
        path = stage.result["paths"][name]
        assert path[0] == pytest.approx([0.0, 175.0], abs=1e-6)
        assert_drawn(stage, path, np.column_stack([np.arange(len(run.rms)), np.maximum(run.rms, 1e-9)]))
    back = np.flatnonzero(np.diff(stage.result["runs"]["trust region"].rms) == 0) + 1
    assert len(back) and set(back) == set(stage.moving[-1].get_xdata())


def test_the_chosen_pose_sees_the_sphere_where_its_residual_ends():
    stage = at(ch05.thirty_one_poses(), click=(12.0, 1.0))
    result, k = stage.result, 11
    scanner = result["T_BF"][k] @ result["T_FS"]
    seen = scanner[:3, :3] @ result["x_S"][k] + scanner[:3, 3]
    assert_drawn(stage, [result["T_BF"][k, :3, 3], scanner[:3, 3], seen])
    assert result["residuals"][k] == pytest.approx(seen - result["target"], abs=1e-9)
    foot = result["T_BF"][k, :3, 3]
    assert_drawn(stage, [foot, foot + 8 * result["residuals"][k]])
    space = stage.spaces[0]
    ball = space.named("sphere").corners()[..., :3].reshape(-1, 3) - result["target"]
    assert np.linalg.norm(ball[ball[:, 2] > 0], axis=1) == pytest.approx(ch05.RADIUS, abs=1e-4)  # rounded
    light = space.named("light").corners().reshape(-1, 3)
    local = (light - scanner[:3, 3]) @ scanner[:3, :3]  # in the scanner: flat in y, from its origin to the field's end
    assert np.abs(local[:, 1]).max() < 1 and [local[:, 2].min(), local[:, 2].max()] == pytest.approx([0, 290])
    assert [local[:, 0].min(), local[:, 0].max()] == pytest.approx([-25 * 1.15, 25 * 1.15])
    plate = (space.named("flange plate").corners().reshape(-1, 3) - foot) @ result["T_BF"][k, :3, :3]
    assert plate[:, 2].max() == pytest.approx(0, abs=1e-6)  # its face is the flange frame's plane
    assert_drawn(stage, [[12, max(result["lengths"][k], 0.08) * 1.5]])


def test_used_field_and_flanges_of_a_pattern():
    stage = at(ch05.pattern_designer(), E=(10.0, 255.0))
    assert_drawn(stage, [[-10, 225], [10, 225], [10, 255], [-10, 255], [-10, 225]])
    T_BF, x_S = stage.result["T_BF"], stage.result["x_S"]
    assert_drawn(stage, T_BF[:, :3, 3], x_S[:, [0, 2]])
    places = np.einsum("nij,nj->ni", T_BF[:, :3, :3] @ stage.result["T_FS"][:3, :3], x_S)
    places += T_BF[:, :3, :3] @ stage.result["T_FS"][:3, 3] + T_BF[:, :3, 3]
    np.testing.assert_allclose(places, np.tile(stage.result["target"], (len(places), 1)), atol=1e-8)


def test_errors_of_differences_follow_their_orders():
    """Where rounding does not matter yet, a step ten times as long errs ten times as much, or a hundred."""
    short, long = at(ch05.difference_steps(), h=0.1), at(ch05.difference_steps(), h=1.0)
    for scheme, factor in (("forward", 10.0), ("central", 100.0)):
        assert long.result["at"][scheme] == pytest.approx(factor * short.result["at"][scheme], rel=0.02)
        assert_drawn(long, [[0.0, long.result["at"][scheme]]])
    curve = long.result["curve"]
    assert_drawn(
        long, np.column_stack([ch05.AROUND, curve]), [(0, 0), (1, curve[50])], [(-1, curve[10]), (1, curve[50])]
    )


# --- chapter 6 --------------------------------------------------------------------------------------------------------


def test_the_arm_upright_has_its_shoulder_on_the_left():
    """The drawing's convention at zero: everything above the shoulder, which is offset along the second axis, +y."""
    stage = at(ch06.tx40(), q1=0.0, q2=0.0, q3=0.0, q4=0.0, q5=0.0, q6=0.0)
    plate = stage.spaces[0].named("flange plate").corners().reshape(-1, 3)
    assert plate[:, 2].max() == pytest.approx(835) and plate[plate[:, 2] > 834.9].mean(0) == pytest.approx([0, 35, 835])
    bar = stage.spaces[0].named("upper arm").corners().reshape(-1, 3)
    assert [bar[:, 2].min(), bar[:, 2].max()] == pytest.approx([320 - 62, 545 + 48], abs=1.5)  # round both joints
    assert bar[:, 1].min() == pytest.approx(35 + 12)  # beside the plane of the forearm


def test_the_arms_bodies_follow_its_joints():
    """Base, shoulder, elbow and wrist by elementary rotations: each body holds the joint it turns about."""
    q = dict(q1=35.0, q2=-20.0, q3=70.0, q4=25.0, q5=40.0, q6=-60.0)
    stage = at(ch06.tx40(), **q)
    turn = Rotation.from_euler("z", 35, degrees=True)
    lean = turn * Rotation.from_euler("y", -20, degrees=True)
    fold = turn * Rotation.from_euler("y", 50, degrees=True)
    shoulder = np.array([0, 0, 320.0]) + turn.apply([0, 35, 0])
    elbow = shoulder + lean.apply([0, 0, 225])
    wrist = elbow + fold.apply([0, 0, 225])
    hand = fold * Rotation.from_euler("ZYZ", [25, 40, -60], degrees=True)
    flange = wrist + hand.apply([0, 0, 65])
    assert flange == pytest.approx(stage.state["flange"], abs=1e-9)
    bar = stage.spaces[0].named("upper arm").corners().reshape(-1, 3)
    along = (bar - shoulder) @ lean.apply([0, 0, 1])
    assert [along.min(), along.max()] == pytest.approx([-62, 225 + 48], abs=1.5)
    forearm = stage.spaces[0].named("forearm").corners().reshape(-1, 3)
    assert ((forearm - elbow) @ fold.apply([0, 0, 1])).max() == pytest.approx(225 + 30, abs=1.0)
    off = np.linalg.norm(np.cross(forearm - wrist, fold.apply([0, 0, 1])), axis=1)  # from its own axis
    assert off.max() == pytest.approx(np.hypot(34, 30), abs=1e-6)  # the ends of the joint across it
    plate = stage.spaces[0].named("flange plate").corners().reshape(-1, 3)
    face = plate[(plate - flange) @ hand.apply([0, 0, 1]) > -1e-6]
    assert len(face) and face.mean(0) == pytest.approx(flange, abs=1e-6)
    rings = [item.value for item in stage.spaces[0].items if item.called == "a path"]
    spun = fold * Rotation.from_euler("Z", 25, degrees=True)
    axes = fold.apply([0, 0, 1]), spun.apply([0, 1, 0]), hand.apply([0, 0, 1])
    for axis, radius in zip(axes, (112, 92, 72)):
        assert any(
            len(ring) == 85 and np.allclose((ring - wrist) @ axis, 0, atol=1e-6)
            and np.allclose(np.linalg.norm(ring - wrist, axis=1), radius) for ring in rings
        )  # fmt: skip


def test_dials_of_the_joints_lie_on_what_they_turn():
    stage = at(ch06.tx40(), q1=35.0, q2=-20.0, q3=70.0, q4=25.0, q5=40.0)
    dials, result = stage.handles, stage.result
    frames = result["frames"]
    assert dials["q2"].point(-20.0, result) == pytest.approx(frames[2, :3, 3], abs=1e-9)  # the elbow
    elbow, wrist = frames[2, :3, 3], frames[4, :3, 3]
    assert dials["q3"].point(70.0, result) == pytest.approx(elbow + (wrist - elbow) * 110 / 225, abs=1e-9)
    for k, name in enumerate(ch06.WRIST):
        off = dials[name].point(stage.state[name], result) - wrist
        assert off @ frames[3 + k, :3, 2] == pytest.approx(0, abs=1e-9)


def test_the_reach_is_that_of_the_stretched_arm():
    """Where forward kinematics brings the wrist with the elbow straight lies on the shell, for every q1 and q2."""
    stage = at(ch06.tx40(), reach=True)
    profile = np.array(stage.spaces[0].named("reach").parts[0].shape["profile"])
    for q2 in np.linspace(0, 125, 25):
        wrist = link_frames(TX40.dh, np.deg2rad([77.0, q2, 0, 0, 0, 0]))[4, :3, 3]
        assert np.hypot(profile[:, 0] - np.hypot(*wrist[:2]), profile[:, 1] - wrist[2]).min() < 1e-3


def test_rays_lead_from_the_stations_to_the_diode():
    A, B, P = (-1200.0, -1800.0), (900.0, -2000.0), (200.0, 400.0)
    stage = at(ch06.sweeps(), A=A, B=B, P=P)
    assert_drawn(stage, [A, P, GAP, B, P], [A, B], [P], stage.result["found"])


def test_the_error_of_each_stop_after_the_first_is_drawn():
    stage = at(ch06.moved_station(), tilt=3.0, when="after stop 10")
    assert_drawn(stage, np.column_stack([np.arange(1, 21), stage.result["errors"][1:]]))


def test_the_whole_cell_stands_where_its_numbers_say():
    stage = at(ch06.whole_cell(), P=(100.0, 200.0, 100.0), turn=90.0, source="tip", spoil=1.0)
    space, result = stage.spaces[0], stage.result
    hole = np.array([100 - 55.0, 200 + 80.0, 100.0])
    assert result["reached"] and result["hole"] == pytest.approx(hole)
    assert_drawn(stage, [hole + whole_cell.ENLARGED * m for m in result["cloud"]])
    part = space.named("part").corners().reshape(-1, 3)
    for mark in ((100.0, 200.0), (100.0, 310.0), (20.0, 225.0)):  # the plate under each, turned by 90 deg
        assert np.hypot(*(part[part[:, 2] > 102][:, :2] - mark).T).min() < 7
    T_BF = result["T_BF"]
    flange = space.named("flange plate").corners().reshape(-1, 3)
    assert np.abs((flange - T_BF[:3, 3]) @ T_BF[:3, 2]).min() < 1e-3  # its face, by the arm's own kinematics
    assert_rod(stage, "tool", T_BF[:3, 3], T_BF[:3, 3] + T_BF[:3, :3] @ result["cell"].tip)
    miss = space.items[[item.called for item in space.items].index("miss")]
    assert miss.value[:3, 3] == pytest.approx(hole)  # the shaft begins at the hole


def test_of_the_whole_cell_the_chosen_transform_shows_its_covariance_enlarged():
    stage = at(ch06.whole_cell(), source="scanner", spoil=0.0)
    cell, T_BF = stage.result["cell"], stage.result["T_BF"]
    ellipsoid = next(item for item in stage.spaces[0].items if item.called == "an ellipsoid")
    R = T_BF[:3, :3]
    assert ellipsoid.value == pytest.approx((T_BF @ cell.T_FS)[:3, 3])
    assert ellipsoid.shape == pytest.approx((3 * whole_cell.ENLARGED) ** 2 * R @ cell.cov_FS[3:, 3:] @ R.T)
    tip = at(stage, source="tip", spoil=0.5).result
    off = tip["off"][:3, 3] - (tip["T_BF"] @ [*whole_cell.cell.TRUTH.tip, 1])[:3]
    wrong = np.linalg.norm(tip["cell"].tip - whole_cell.cell.TRUTH.tip)
    assert np.linalg.norm(off) == pytest.approx(whole_cell.ENLARGED * wrong)


class OneTrail:
    """A scene that only remembers what was set."""

    class Item:
        def set(self, value):
            self.value = np.asarray(value)

        def name_at(self, *_):
            pass

    def points(self, **_):
        return self.Item()

    line = points

    def triad(self, *_, **__):
        return self.Item()

    body = triad

    def fixed(self, item, value):
        item.set(value)


def test_trail_sorts_readings_by_the_gate():
    trail = ch06_figures.Trail(OneTrail(), Figure().subplots())
    positions, used = np.arange(12.0).reshape(4, 3), np.array([True, False, True, True])
    trail.set(positions, used, positions + 1, np.eye(4))
    np.testing.assert_array_equal(trail.readings.value, positions[[0, 2, 3]])
    np.testing.assert_array_equal(trail.rejected.value, positions[[1]])
    np.testing.assert_array_equal(trail.path.value, positions + 1)


def test_sheets_of_light_cross_the_tracker_in_the_middle_of_their_sweep():
    stage = at(ch06.live_tracker(), t=0.0)
    space, place = stage.spaces[0], np.array([120.0, -80.0, 60.0])
    sweep = ch06_figures.Sweep(Scene(Figure().subplots(), radius=500), ch06.NEARBY)
    scene = sweep.sheets[0].scene
    for k in range(2):
        sweep.set(*ch06.sheets_of_light(1.0 + 2.0 * k, place))  # s: half a sweep, and half of the other station's
        assert [sheet.shown for sheet in sweep.sheets] == [k == 0, k == 1]
        corners = scene.named(f"sheet {k + 1}").corners().reshape(-1, 3)
        normal = np.linalg.svd(corners - corners.mean(0))[2][2]
        assert abs((place - corners.mean(0)) @ normal) < 1e-6  # in its plane,
        station = scene.named(f"station {k + 1}").value
        assert np.linalg.norm(corners - station[:3, 3], axis=1).min() < 0.51  # which begins in the station
        aim = np.array([-60.0, 60.0, 0.0]) - station[:3, 3]
        assert station[:3, 2] == pytest.approx(aim / np.linalg.norm(aim))
    assert space.named("puck").value == pytest.approx(stage.result["T_WE"])


def test_live_picture_draws_what_arrived(monkeypatch):
    packets = simulation.endless_packets(np.random.default_rng(3), lambda: True)
    readings = np.array([decode_packet(next(packets)) for _ in range(300)])
    monkeypatch.setattr(ch06.Link, "look", lambda *_: (readings, udp.Statistics(datagrams=300, good=300)))
    stage = at(ch06.live_tracker(), t=0.02)
    positions, used = 1000 * readings[:, POSITION], stage.result["used"]
    assert 0 < np.count_nonzero(~used) < 30
    assert_drawn(stage, positions[used], positions[~used], stage.result["filtered"])
    words = next(a.get_text() for a in stage.moving if isinstance(a, Text) and "datagrams" in a.get_text())
    assert f"of 300   {np.count_nonzero(~used)}\n" in words


def test_rotation_axes_pass_through_the_middle():
    a, b = np.array([0.6, 0.0, 0.8]), np.array([0.0, 1.0, 0.0])
    stage = at(ch06.two_axes(), a=a, b=b)
    for name, axis in (("axis a", a), ("axis b", b)):
        arrow = [item.corners() for item in stage.spaces[0].items if item.called == name]
        corners = np.concatenate(arrow).reshape(-1, 3)
        assert [(corners @ axis).min(), (corners @ axis).max()] == pytest.approx([0, 1])
    assert_drawn(stage, [-a, a], [-b, b], *([np.zeros(3), 0.55 * axis] for axis in ch06.X_TRUE[:3, :3].T))
    assert_drawn(stage, 0.55 * stage.result["found"][:, :, 0])


def test_errors_in_motion_stand_over_their_time():
    stage = ch06.dynamic_errors()
    r = stage.result
    good = ~r["bad"]
    assert_drawn(
        stage, np.column_stack([r["share"], r["error"]])[good], np.column_stack([r["share"], r["error"]])[~good]
    )
    assert_drawn(stage, np.column_stack([r["share"], r["mended"]])[r["keep"]])
    assert_drawn(stage, np.column_stack([range(4), [r["raw_summary"][n] for n in ("mean", "RMS", "median", "95 %")]]))


def test_methods_stand_in_their_rows():
    stage = ch06.methods()
    rows = np.arange(len(stage.result["names"]))
    assert_drawn(stage, *(np.column_stack([stage.result[k], rows]) for k in ("rotation", "translation")))


def test_ellipsoids_of_six_runs_are_three_standard_deviations():
    stage = ch06.six_runs()
    r, truth = stage.result, simulation.T_FE[:3, 3]
    assert_drawn(stage, r["results"] - truth, [np.zeros(3), r["mean"] - truth])
    bodies = [i for i in stage.spaces[0].items if i.called == "an ellipsoid"]
    ball = np.random.default_rng(0).normal(size=(50, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    for body, center, cov in zip(bodies, (r["mean"], r["single"]), (r["spread"], r["claim"]), strict=True):
        T = body.numbers()  # carries the unit sphere onto the ellipsoid that the page draws
        d = ball @ T[:3, :3].T + T[:3, 3] - (center - truth)
        np.testing.assert_allclose((d * np.linalg.solve(cov, d.T).T).sum(1), 9.0)


# --- chapter 7 --------------------------------------------------------------------------------------------------------


def test_methods_that_work_are_ticked_and_the_others_say_why():
    stage = at(ch07.methods(), sensor="odometry", task="global")
    names, verdicts = np.reshape([a.get_text().replace("\n", " ") for a in stage.moving], (2, -1))
    works = [verdict.endswith("works") for verdict in verdicts]
    assert stage.result["usable"] == names[works].tolist()
    assert all(why in verdict for why, verdict in zip(stage.result["verdicts"], verdicts))
    heights = [a.get_position()[1] for a in stage.moving]
    assert heights[: len(names)] == heights[len(names) :] == sorted(set(heights), reverse=True)


def test_distance_circles_have_the_measured_radii():
    stage = at(ch07.circles(), count=3, R=(4.0, 2.0))
    rings = next(v for v in drawn(stage) if np.isnan(v).sum() == 6 and len(v) > 100)
    for ring, name, distance in zip(rings.reshape(3, -1, 2), "ABC", stage.result["distances"]):
        np.testing.assert_allclose(np.linalg.norm(ring[:-1] - stage.state[name], axis=1), distance)
    sights = [row for name in "ABC" for row in (stage.state[name], (4.0, 2.0), GAP)]
    assert_drawn(stage, sights, stage.result["path"], stage.result["cloud"])


def test_models_of_motion_leave_the_same_start():
    stage = at(ch07.models(), count=4, omega_deg=30.0)
    radius, turn = 1 / np.deg2rad(30), np.deg2rad(30) * np.linspace(0, 5, 61)
    assert_drawn(stage, radius * np.column_stack([np.sin(turn), 1 - np.cos(turn)]))
    heading = np.deg2rad(30) * 1.25 * np.arange(4)
    steps = 1.25 * np.column_stack([np.cos(heading), np.sin(heading)])
    assert_drawn(stage, np.vstack([[0, 0], np.cumsum(steps, axis=0)]))  # the simplified model: straight, then turn


def test_driven_robot_points_where_it_drives():
    stage = at(ch07.drive(), t=3.0)
    truth, estimate = stage.result["truth"], stage.result["estimate"]
    assert_drawn(stage, truth[:, :2], estimate[:, :2], stage.result["outlines"])
    for pose in (truth[-1], estimate[-1]):
        outline = [v for v in drawn(stage) if v.shape == (5, 2)]
        ahead = pose[:2] + 0.6 * 0.65 * np.array([np.cos(pose[2]), np.sin(pose[2])])  # the tip of the arrowhead
        assert any(np.abs(v - ahead).sum(1).min() < 1e-9 for v in outline)


def test_banana_and_its_ellipse():
    stage = ch07.banana()
    r = stage.result
    assert_drawn(
        stage, r["poses"][:, :2], r["ends"][:, :2], r["outline"], r["poses"][-1:, :2], [r["ends"][:, :2].mean(0)]
    )


# --- chapter 8 --------------------------------------------------------------------------------------------------------


def test_bells_hold_one_and_stand_over_their_means():
    stage = at(ch08.bells(), z=(11.0, 0.5))
    found = drawn(stage)
    assert len(found) == 4
    for curve, (mean, std) in zip(found, (stage.result["before"], *stage.result["bells"])):
        x, density = curve.T
        assert np.trapezoid(density, x) == pytest.approx(1.0, abs=1e-3)
        assert np.trapezoid(x * density, x) == pytest.approx(mean, abs=1e-2)
        assert np.trapezoid((x - mean) ** 2 * density, x) == pytest.approx(std**2, rel=0.02)


def test_vehicle_errors_within_twice_the_promised_deviation():
    stage = ch08.vehicle()
    r, gap = stage.result, [np.nan, np.nan]
    for k in (0, 1):
        upper = np.column_stack([r["time"], 2 * r["std"][:, k]])
        assert_drawn(stage, np.column_stack([r["time"], r["error"][:, k]]), np.vstack([upper, gap, upper * [1, -1]]))
    assert_drawn(stage, np.column_stack([r["time"], r["measured"]]), [[1.0, r["nis"]]])
    at_ = stage.state["P"][0]
    assert_drawn(stage, [(at_ - 0.2, 2.0), (at_, 2.0), (at_, -2.0), (at_ - 0.2, -2.0)])


def test_arena_draws_what_the_filter_believes():
    stage = at(ch08.arena(), t=2.0, count=2)
    r = stage.result
    assert_drawn(stage, r["truth"][:, :2], r["estimate"][:, :2], r["ellipse"], r["landmarks"], r["seen"])
    assert_drawn(stage, np.column_stack([np.arange(1, len(r["nees"]) + 1), r["nees"]]))
    off = np.linalg.norm(r["ellipse"].mean(0) - r["estimate"][-1, :2])
    assert off < 0.05 * np.ptp(r["ellipse"], axis=0).max()


def test_honesty_marks_the_chosen_number_of_iterations():
    stage = at(ch08.honesty(), iterations=3)
    r = stage.result
    assert_drawn(stage, r["positions"], r["ellipse"], [[3, r["curve"][2]]])


# --- chapter 9 --------------------------------------------------------------------------------------------------------


def upright(x, heights):
    """Bars from 0 to their heights, as one broken line, (3 n, 2)."""
    return np.array([row for a, b in zip(x, heights) for row in ((a, 0.0), (a, b), (a, np.nan))])


def robot_mark(pose, radius):
    """A circle about a pose, a gap, and a nose from its middle to 1.9 radii ahead, (28, 2)."""
    turn = np.linspace(0, 2 * np.pi, 25) + pose[2]
    ahead = np.array([np.cos(pose[2]), np.sin(pose[2])])
    circle = pose[:2] + radius * np.column_stack([np.cos(turn), np.sin(turn)])
    return [*circle, GAP, pose[:2], pose[:2] + 1.9 * radius * ahead]


def rays(pose, ends):
    return [row for end in ends for row in (pose[:2], end, GAP)]


def test_corridor_stands_on_its_doors_and_particles():
    stage = at(ch09.corridor(), D1=(1.0, 0.0), D2=(5.0, 0.0), D3=(10.0, 0.0), robot=(5.0, 1.0))
    assert_drawn(stage, [row for x in (1, 5, 10) for row in ((x - 0.25, 0), (x + 0.25, 0), (np.nan, 0))])
    for (x, height, truth), moved in zip(stage.result["shots"], (0, 0, 2, 2, 4), strict=True):
        assert truth == 5.0 + moved  # two moves of 2 m
        assert_drawn(stage, upright(x, height), [[truth, 1.0]])


def test_six_maps_share_the_probe_and_show_what_they_mean():
    stage, b = at(ch09.map_forms(), probe=(3.0, 4.0)), load_building()
    assert [ax.get_title(loc="left").split(",")[0] for ax in stage.figure.axes] == list(ch09.FORMS)
    assert sum(v.shape == (1, 2) and np.allclose(v, (3.0, 4.0)) for v in drawn(stage)) == 6
    means = stage.result["means"]
    assert_drawn(stage, *([(3.0, 4.0), means[form]] for form in ("lines", "points", "graph")))
    still = [line.get_xydata() for ax in stage.figure.axes for line in ax.lines if line not in stage.moving]
    for points in ([row for wall in b.lines for row in (wall[:2], wall[2:], GAP)], b.points, list(b.nodes.values())):
        assert any(v.shape == np.shape(points) and np.allclose(v, points, equal_nan=True) for v in still)


def test_scan_starts_at_the_robot_in_both_pictures():
    stage = at(ch09.field_against_beams(), robot=(8.0, 2.0), heading_deg=40)
    pose, ends = np.array([8.0, 2.0, np.deg2rad(40)]), stage.result["ends"]
    assert_drawn(stage, robot_mark(pose, 0.35), rays(pose, ends), ends)
    assert sum(v.shape == ends.shape for v in drawn(stage)) == 2
    walls = load_building().grid.distance
    i, j = load_building().grid.cell_of(ends)
    assert np.median(walls[i, j]) < 0.2  # what is drawn as seen lies on the walls: cells of 0.1 m, noise of the scanner
    pictures = [stage.result[name] for name in ("beams", "field")]
    images = [a for a in stage.moving if isinstance(a, PcolorImage)]
    for image, weights in zip(images, pictures, strict=True):
        assert np.nanmax(weights) == 0.0  # relative to the best place
        assert np.array_equal(np.ma.filled(image.get_array(), np.nan).ravel(), weights.ravel(), equal_nan=True)


def test_sectors_are_as_wide_as_the_weights_and_the_spokes_point_at_them():
    stage = at(
        ch09.wheel(), **{f"W{k + 1}": (k + 1, w) for k, w in enumerate((0.2, 0.4, 0.0, 0.4, 0.6, 0.4))}, turn=0.5
    )
    sectors = [a for a in stage.moving if isinstance(a, Wedge)]
    assert [a.theta2 - a.theta1 for a in sectors] == pytest.approx([36, 72, 0, 72, 108, 72])
    assert sectors[0].theta2 == pytest.approx(90) and sectors[1].theta2 == pytest.approx(54)  # clockwise from the top
    places = 2 * np.pi * (np.arange(6) + 0.5) / 6
    ends = 0.98 * np.column_stack([np.sin(places), np.cos(places)])
    assert_drawn(stage, rays(np.zeros(2), ends), upright(range(1, 7), (0.2, 0.4, 0.0, 0.4, 0.6, 0.4)))
    assert stage.result["counts"].tolist() == [1, 1, 0, 1, 2, 1]  # 30, 90, 150, 210, 270, 330 deg: by the sectors above


def test_standing_clouds_are_what_is_left():
    stage = at(ch09.standing(), rounds=40)
    for method, left in stage.result["left"].items():
        cloud = stage.result["clouds"][method]
        assert len(cloud) == left[-1]
        assert_drawn(stage, cloud, np.column_stack([range(41), left]))


def test_picture_of_the_twelve():
    stage = at(ch09.twelve_pictures(), particles=200, t=2.0)
    r = stage.result
    assert r["number"] == 5 and len(r["path"]) == 5
    assert_drawn(stage, r["states"][:, :2], robot_mark(r["truth"], 0.35), robot_mark(r["estimate"], 0.35), r["path"])
    np.testing.assert_array_equal(r["path"][-1], r["truth"][:2])


def test_soccer_robot_looks_at_the_landmark_it_sees():
    stage = ch09.soccer()
    seen = next(t for t in np.arange(0, 40, 0.4) if at(stage, t=t).result["seen"] >= 0)
    r = at(stage, t=seen).result
    k, past = r["step"], r["errors"]["MCL"][: r["step"] + 1]
    assert_drawn(stage, np.column_stack([0.4 * np.arange(1, k + 2), np.maximum(past, 0.01)]))
    assert_drawn(stage, robot_mark(r["odometry"][-1], 0.12))
    robot = r["truth"][-1]
    assert_drawn(stage, [robot[:2], r["landmarks"][r["seen"]]], robot_mark(robot, 0.12), r["states"][:, :2])
    assert_drawn(stage, r["truth"][:, :2], r["odometry"][:, :2], r["estimates"][:, :2])
    toward = r["landmarks"][r["seen"]] - robot[:2]
    off = np.arctan2(toward[1], toward[0]) - robot[2]
    assert abs((off + np.pi) % (2 * np.pi) - np.pi) < np.deg2rad(28)  # within the camera's view


def test_arena_draws_robot_estimate_scan_and_errors():
    stage = at(ch09.arena(), particles=500, t=1.5)
    r = stage.result
    assert len(r["errors"]) == 4  # before the first step, and after three
    assert_drawn(stage, r["states"][:, :2], robot_mark(r["pose"], 0.35), robot_mark(r["estimate"], 0.35))
    assert_drawn(stage, r["ends"], rays(r["pose"], r["ends"]), np.column_stack([range(4), r["errors"]]))


def test_obstacles_are_circles_about_their_places():
    disks = ch09.draw.Disks(Figure().subplots())
    disks.set(np.array([[2.0, 3.0, 0.15], [7.0, 1.0, 0.4]]))
    for outline, (x, y, radius) in zip(disks.line.get_xydata().reshape(2, -1, 2), [(2, 3, 0.15), (7, 1, 0.4)]):
        assert np.isnan(outline[-1]).all()
        np.testing.assert_allclose(np.linalg.norm(outline[:-1] - (x, y), axis=1), radius)


# --- chapter 11 -------------------------------------------------------------------------------------------------------


def test_a_pose_left_out_is_crossed_and_what_slides_unseen_lies_along_the_axis_of_the_others():
    stage = ch11.pose_left_out()
    stage.make_it_fail()
    T_BF, space = stage.result["T_BF"], stage.spaces[0]
    assert_drawn(stage, [T_BF[3, :3, 3], [np.nan] * 3], [*np.delete(T_BF[:, :3, 3], 3, axis=0)])
    axis = Rotation.from_matrix(T_BF[9, :3, :3] @ T_BF[0, :3, :3].T).as_rotvec()
    start, end = space.items[-1].value
    assert (start + end) / 2 == pytest.approx(CELL.T_BT[:3, 3])
    assert abs((end - start) @ axis) == pytest.approx(500 * np.linalg.norm(axis))
