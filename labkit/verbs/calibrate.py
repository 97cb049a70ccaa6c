"""`labkit calibrate`: poses of one's own in, a calibration with covariance, outliers and advice out.

labkit calibrate hand-eye --robot R --sensor S [--eye-to-hand]
labkit calibrate pivot POSES
labkit calibrate sphere --robot R --points P
labkit calibrate frame POINTS [--nominal N]
labkit calibrate compare --a A --b B
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..calibration import calibrate
from ..estimation.clocks import sample_stream
from ..fast.ax_xb import calibrate_hand_eye
from ..fast.hand_eye import calibrate_sphere_target
from ..files.bags import read_bag
from ..files.points import read_points
from ..files.poses import FORMATS, read_pairs, read_poses, refuse_other_rows, refuse_times
from ..files.text import naming
from ..geometry.frames import kuka_from_matrix
from . import report
from .arguments import Parser, Refusal, run, write

FILES = ("bag", "robot", "sensor", "poses", "points", "nominal", "a", "b")  # options that hold one
MAGNIFIED = (1, 10, 100, 1000, 10_000, 100_000)  # times, that an ellipsoid is drawn larger than it is


def main(arguments):
    """Run one kind of calibration on files, and print or write what came out."""
    options = _parser().parse_args(arguments)
    with naming(*(getattr(options, name, None) for name in FILES)):
        result, assumed = KINDS[options.kind](options)
    for line in assumed:
        print(line)
    print(*result.lines(), sep="\n")
    if options.out:
        write(
            options.out,
            result__json=result.as_dict(),
            report__html=report_of(result, assumed, options.robot_name),
        )
        print(f"written: {options.out / 'result.json'}, {options.out / 'report.html'}")


def _parser():
    parser = Parser("calibrate", description="Calibrate from your own poses.")
    kinds = parser.add_subparsers(dest="kind", required=True, parser_class=Parser, metavar="KIND")
    hand_eye = kinds.add_parser("hand-eye", help="a sensor on a flange, or beside the robot")
    hand_eye.add_argument("--robot", type=Path, help="flange in base")
    hand_eye.add_argument("--sensor", type=Path, help="target in sensor")
    hand_eye.add_argument("--eye-to-hand", action="store_true", help="the sensor stands still, the target moves")
    pivot = kinds.add_parser("pivot", help="the tip of a tool that touches one point")
    pivot.add_argument("poses", type=Path)
    sphere = kinds.add_parser("sphere", help="a scanner on a flange that sees one sphere")
    sphere.add_argument("--robot", type=Path, required=True, help="flange in base")
    sphere.add_argument("--points", type=Path, required=True, help="centers of the sphere in the sensor")
    frame = kinds.add_parser("frame", help="a frame from measured points")
    frame.add_argument("points", type=Path)
    frame.add_argument("--nominal", type=Path, help="where the same points sit in the frame")
    compare = kinds.add_parser("compare", help="two streams of poses of one motion")
    compare.add_argument("--a", type=Path, required=True, help="the reference, with times")
    compare.add_argument("--b", type=Path, required=True, help="what is judged, with times")
    compare.add_argument("--max-offset", type=float, help="search for the clock offset within this (s)")
    compare.add_argument("--max-gap", type=float, help="samples farther apart are not joined (s)")
    for name, one in kinds.choices.items():
        one.add_argument("--length", choices=("m", "mm"), help="unit of the files and of the result")
        one.add_argument("--any-size", action="store_true", help="accept positions that are implausibly large or small")
        one.add_argument("--out", type=Path, help="folder for result.json and report.html")
        if name not in ("frame",):
            one.add_argument("--format", choices=FORMATS, help="of the poses; recognized without it")
            one.add_argument("--angle", choices=("deg", "rad"), help="unit of A B C or of the rotation vector")
            one.add_argument("--quaternion", choices=("xyzw", "wxyz"), help="order in columns without titles")
        if name in ("hand-eye", "frame"):
            one.add_argument("--std-trans", type=float, help="noise of a reading, length unit")
        if name == "hand-eye":
            one.add_argument("--std-rot-deg", type=float, help="noise of a reading, deg")
            one.add_argument("--bag", type=Path, help="a ROS recording in place of the two files")
            one.add_argument("--robot-topic", help="topic of the flange, or frames BASE:FLANGE of tf")
            one.add_argument("--sensor-topic", help="topic of the target, or frames SENSOR:TARGET of tf")
        one.set_defaults(robot_name={"pivot": "tool"}.get(name, "flange"))
    return parser


# --- the kinds -------------------------------------------------------------------------------------------------------


def _poses(options, path):
    return read_poses(path, options.format, options.length, options.angle, options.quaternion, options.any_size)


def _same_unit(options, *files):
    """The unit of the result: as told, else of the first file."""
    return options.length or files[0].length


def _hand_eye(options):
    if options.bag:
        robot, sensor = _from_bag(options)
    elif options.robot and not options.sensor and options.robot.suffix.lower() == ".json":
        robot, sensor = read_pairs(options.robot, options.length, options.any_size)
    elif not options.robot or not options.sensor:
        raise Refusal("a hand-eye calibration needs --robot and --sensor (or one JSON file of pairs as --robot)")
    else:
        robot, sensor = _poses(options, options.robot), _poses(options, options.sensor)
    refuse_other_rows(robot, sensor)
    unit = _same_unit(options, robot, sensor)
    groups = robot.group if robot.group is not None else sensor.group
    std_rot = None if options.std_rot_deg is None else np.deg2rad(options.std_rot_deg)
    for name, std in (("--std-rot-deg", std_rot), ("--std-trans", options.std_trans)):
        if std is not None and not std > 0:
            raise Refusal(f"{name} must be positive, got {std:g}")
    result = calibrate.hand_eye(
        robot.in_unit(unit).T,
        sensor.in_unit(unit).T,
        eye_to_hand=options.eye_to_hand,
        std_rot=std_rot,
        std_trans=options.std_trans,
        groups=groups,
        length_unit=unit,
        solver=calibrate_hand_eye,
    )
    return result, (robot.assumed, sensor.assumed)


def _from_bag(options):
    """Robot and sensor of a recording: the robot where it was when the sensor saw the target, gaps left out."""
    if not options.robot_topic or not options.sensor_topic:
        raise Refusal("--bag needs --robot-topic and --sensor-topic (or frames of tf, such as base:tool0)")
    robot, sensor = read_bag(options.bag, [options.robot_topic, options.sensor_topic])
    if len(robot) < 2:
        raise Refusal(f"{robot.name}: {options.robot_topic} holds one pose only")
    poses, known = sample_stream(robot.time, robot.T, sensor.time)
    rows = np.flatnonzero(known)
    if len(rows) > calibrate.FIT_ROWS:  # spread evenly
        rows = rows[np.linspace(0, len(rows) - 1, calibrate.FIT_ROWS).astype(int)]
    places = tuple(sensor.places[k] for k in rows)
    return (
        replace(robot, T=poses[rows], time=sensor.time[rows], places=places),
        replace(sensor, T=sensor.T[rows], time=sensor.time[rows], places=places),
    )


def _pivot(options):
    poses = _poses(options, options.poses)
    unit = _same_unit(options, poses)
    return calibrate.pivot(poses.in_unit(unit).T, groups=poses.group, length_unit=unit), (poses.assumed,)


def _sphere(options):
    robot = _poses(options, options.robot)
    points = read_points(options.points, options.length, options.any_size)
    refuse_other_rows(robot, points)
    unit = _same_unit(options, robot)
    result = calibrate.sphere(
        robot.in_unit(unit).T,
        points.in_unit(unit),
        groups=robot.group,
        length_unit=unit,
        solver=calibrate_sphere_target,
    )
    return result, (robot.assumed, points.assumed)


def _frame(options):
    points = read_points(options.points, options.length, options.any_size)
    nominal = options.nominal and read_points(options.nominal, options.length, options.any_size)
    unit = _same_unit(options, points)
    if nominal:
        refuse_other_rows(points, nominal)
    elif len(points) != 3:
        raise Refusal(f"{points.name}: a frame through points needs 3 of them, got {len(points)}; or give --nominal")
    result = calibrate.frame(
        points.in_unit(unit), nominal and nominal.in_unit(unit), std_trans=options.std_trans, length_unit=unit
    )
    return result, (points.assumed, *((nominal.assumed,) if nominal else ()))


def _compare(options):
    a, b = _poses(options, options.a), _poses(options, options.b)
    refuse_times(a)
    refuse_times(b)
    unit = _same_unit(options, a)
    result = calibrate.compare(
        a.time, a.in_unit(unit).T, b.time, b.in_unit(unit).T,
        length_unit=unit, max_offset=options.max_offset, max_gap=options.max_gap, solver=calibrate_hand_eye,
    )  # fmt: skip
    return result, (a.assumed, b.assumed)


KINDS = {"hand-eye": _hand_eye, "pivot": _pivot, "sphere": _sphere, "frame": _frame, "compare": _compare}


# --- the report ------------------------------------------------------------------------------------------------------


def report_of(result, assumed=(), robot_name="flange"):
    """The page of a result: what it is, what disagrees, what stays unknown, what to measure next, and the numbers."""
    unit = result.length_unit
    share = f"{int(result.kept.sum())} of {result.rows} rows agree; rms {result.rms_translation:.4g} {unit}"
    if np.isfinite(result.rms_rotation_deg):
        share += f" and {result.rms_rotation_deg:.4g} deg"
    rejected = f"rejected rows: {', '.join(map(str, result.rejected))}" if result.rejected else "no row was rejected"
    sections = [
        report.paragraphs([f"{result.meaning}. {share}"]),
        report.paragraphs(result.warnings, "warning"),
        report.section("Result", _estimate(result), _plain(result)),
        report.section("What is known worst", report.paragraphs(result.advice, "advice"))
        or report.section("What is known worst", report.paragraphs(["no direction is known much worse than another"])),
        report.section("Residuals by row", report.paragraphs([rejected]), *_charts(result)),
        report.section("Over speed and time", *_comparison(result)),
        report.section("View", _view(result, robot_name)),
        report.section("What to measure next", _next(result, robot_name)),
        report.section("Groups left out", _groups(result)),
        report.section("Numbers", *_numbers(result)),
        report.section("What was assumed", report.paragraphs(assumed, "muted", as_is=True)),
    ]
    return report.page(f"Calibration: {result.kind}", [s for s in sections if s])


def _estimate(result):
    rows = [(name, *values, *std) for name, values, std in result._table()]
    rows += [(f"{name} [{result.length_unit}]", *p, *[np.nan] * 3) for name, p in result.points.items()
             if result.kind != "pivot"]  # fmt: skip
    head = ("", "x", "y", "z", "std x", "std y", "std z")
    note = (
        f"clock offset {result.time_offset.offset:.6f} s, std {result.time_offset.std:.2g} s"
        if result.time_offset
        else ""
    )
    return report.table(head, rows) + report.paragraphs([note] if note else [])


def _plain(result):
    if result.plain is None or not result.rejected:
        return ""
    apart = np.linalg.norm(result.plain.T[:3, 3] - result.T[:3, 3])
    return report.paragraphs(
        [
            f"fitted to all rows, the rejected ones too, the result would lie {apart:.4g} {result.length_unit} away, "
            f"with an rms of {result.plain.rms_translation:.4g} {result.length_unit}"
        ],
        "muted",
    )


def _charts(result):
    r, alone = result.residuals, result.alone
    alone = r if alone is None else alone
    if not len(r):
        return
    if r.shape[1] == 6:
        yield _chart(r[:, :3], alone[:, :3], result.kept, 180 / np.pi, "rotation [deg]")
    yield _chart(r[:, -3:], alone[:, -3:], result.kept, 1.0, f"distance [{result.length_unit}]")
    yield report.paragraphs(
        ["bars: the fit; rings: the row judged by the fit to the others; crosses: rejected"], "muted"
    )


def _chart(residuals, alone, kept, factor, label):
    fitted, others = (factor * np.linalg.norm(v, axis=1) for v in (residuals, alone))
    return report.chart(fitted, kept, label, alone=others)


def _comparison(result):
    found = result.comparison
    if found is None:
        return
    unit = result.length_unit
    head = (f"speed from [{unit}/s]", "to", "samples", "rms [deg]", f"rms [{unit}]")
    yield report.table(head, found.table)
    yield report.curve(found.time - found.time[0], found.translation, "time [s]", f"distance [{unit}]")
    yield report.curve(found.time - found.time[0], found.rotation_deg, "time [s]", "rotation [deg]")


def _view(result, robot_name):
    if result.poses is None or result.kind == "compare":
        return ""
    view, T = report.View(), result.poses
    rows = np.unique(np.linspace(0, len(T) - 1, min(len(T), 60)).astype(int))
    extent = max(np.ptp(T[:, :3, 3], axis=0).max(), np.linalg.norm(result.T[:3, 3]), 1e-9)
    on_flange = "base" not in result.meaning
    for k in rows:
        view.frame(T[k], 0.06 * extent)
        if on_flange:
            view.line([T[k, :3, 3], (T[k] @ result.T)[:3, 3]], "measurement" if result.kept[k] else "muted", 1.0)
    place = (T[rows[0]] if on_flange else np.eye(4)) @ result.T
    view.frame(place, 0.15 * extent, {"pivot": "tip"}.get(result.kind, "sensor"), 3)
    block = result.covariance[:3, :3] if result.kind == "pivot" else result.covariance[3:, 3:]
    R = T[rows[0], :3, :3] if on_flange else np.eye(3)
    times = _magnification(block, extent)
    if np.isfinite(block).all():
        view.ellipsoid(place[:3, 3], R @ block @ R.T, times)
    target = result.points.get("pivot", result.points.get("center"))
    if target is None and result.T_target is not None and on_flange:
        target = result.T_target[:3, 3]
    if target is not None:
        view.frame(
            np.block([[np.eye(3), np.reshape(target, (3, 1))], [np.zeros((1, 3)), 1]]), 0.1 * extent, "target", 2
        )
    said = f"{robot_name} poses, the result at the first of them, its ellipsoid of {times} standard deviations"
    return report.paragraphs([said], "muted") + view.as_html(said)


def _magnification(covariance, extent):
    """How many standard deviations make an ellipsoid that one can see."""
    largest = np.sqrt(max(np.linalg.eigvalsh(covariance)[-1], 1e-300)) if np.isfinite(covariance).all() else extent
    return next((m for m in MAGNIFIED if m * largest > 0.05 * extent), MAGNIFIED[-1])


def _next(result, robot_name):
    if result.next_poses is None:
        return ""
    unit, std = result.length_unit, result.next_std
    rows = []
    for k, T in enumerate(result.next_poses):
        gain = np.sqrt((std[k + 1] ** 2).sum() / (std[0] ** 2).sum()) if result.kind == "pivot" else None
        per_six = std[k + 1] / std[0]
        six = kuka_from_matrix(T)
        rows.append((k + 1, *six[:3], *np.rad2deg(six[3:]), f"{100 * (gain or per_six.mean()):.0f} %"))
    head = ("pose", f"x [{unit}]", "y", "z", "A [deg]", "B", "C", "std left")
    text = (
        f"three more {robot_name} poses that would help most, each with the ones before it: they turn the "
        f"{robot_name} by 30 deg about what it looks at. Check that the robot reaches them and that the target is seen"
    )
    return report.paragraphs([text]) + report.table(head, rows)


def _groups(result):
    if not result.group_shifts:
        return ""
    rows = [(f"{g:g}", *(v / s for v, s in zip(shift, result.std))) for g, shift in result.group_shifts.items()]
    text = "how far the result moves when a group is left out, in standard deviations"
    return report.paragraphs([text]) + report.table(("group", *result.parameters), rows)


def _numbers(result):
    yield report.table(("T", "", "", ""), [tuple(row) for row in result.T])
    if np.isfinite(result.covariance).all():
        rows = [(name, *row) for name, row in zip(result.parameters, result.covariance)]
        yield report.table(("covariance", *result.parameters), rows)
    if len(result.singular_values):
        values = ", ".join(f"{v:.3g}" for v in result.singular_values)
        yield report.paragraphs([f"singular values of the scaled Jacobian: {values}"], "muted")
    for name, std in result.noise.items():
        shown = f"{np.rad2deg(std):.3g} deg" if "rad" in name else f"{std:.3g} {result.length_unit}"
        yield report.paragraphs([f"noise of a reading, {name.split('_')[0]}, per axis: {shown}"], "muted")


if __name__ == "__main__":
    sys.exit(run(main))
