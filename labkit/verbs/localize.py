"""`labkit localize`: a log of one's own in, the path of the robot with its covariance out.

labkit localize --odometry O --landmarks L --measurements M [--truth G]
"""

import io
import sys
from pathlib import Path

import numpy as np

from ..estimation.gaussian import ellipse
from ..fast.path import filter_path
from ..files.logs import read_landmarks, read_odometry, read_readings, read_truth
from ..files.text import naming
from ..localization.locate import NAMES, UNITS, locate
from ..localization.path import LIMIT
from . import report
from .arguments import Parser, Refusal, run, write

SHOWN_POSES, SHOWN_ELLIPSES, SHOWN_ROWS = 2000, 25, 20


def main(arguments):
    """Localize from files, and print or write what came out."""
    options = _parser().parse_args(arguments)
    odometry = read_odometry(options.odometry, options.angle)
    landmarks = read_landmarks(options.landmarks)
    readings = read_readings(options.measurements, options.angle)
    truth = options.truth and read_truth(options.truth, options.angle)
    with naming(options.odometry, options.landmarks, options.measurements, options.truth):
        found = locate(
            odometry.time,
            np.stack([odometry.v, odometry.omega], 1),
            readings.time,
            readings.ids,
            readings.z,
            landmarks.ids,
            landmarks.points,
            noise=_noise(options),
            truth=truth and (truth.time, truth.x),
            filter_path=filter_path,
        )
    print(*found.lines(), sep="\n")
    if options.out:
        about = found.as_dict()
        for row in about["rejected"]:
            row["line"] = int(readings.lines[row["reading"] - 1])
        write(
            options.out, result__json=about, path__csv=_table(found), report__html=report_of(found, landmarks, readings)
        )
        print(f"written: {', '.join(str(options.out / name) for name in ('result.json', 'path.csv', 'report.html'))}")


def _parser():
    parser = Parser("localize", description="The path of a robot from its own log.")
    parser.add_argument("--odometry", type=Path, required=True, help="t v omega: s, m/s, rad/s")
    parser.add_argument("--landmarks", type=Path, required=True, help="id x y: m")
    parser.add_argument("--measurements", type=Path, required=True, help="t id range bearing: s, m, rad")
    parser.add_argument("--truth", type=Path, help="t x y theta: s, m, rad")
    parser.add_argument("--angle", choices=("deg", "rad"), help="unit of angles in columns that do not say")
    parser.add_argument("--std-range", type=float, help="m; fitted without it")
    parser.add_argument("--std-bearing-deg", type=float, help="deg; fitted without it")
    parser.add_argument("--std-way", type=float, help="m per root second of the odometry; fitted without it")
    parser.add_argument("--std-turn-deg", type=float, help="deg per root second of the odometry; fitted without it")
    parser.add_argument("--out", type=Path, help="folder for result.json, path.csv and report.html")
    return parser


def _noise(options):
    """Standard deviations that were given, by the names of the filter."""
    given = {
        "std_range": (options.std_range, "--std-range", 1.0),
        "std_bearing": (options.std_bearing_deg, "--std-bearing-deg", np.pi / 180),
        "std_way": (options.std_way, "--std-way", 1.0),
        "std_turn": (options.std_turn_deg, "--std-turn-deg", np.pi / 180),
    }
    for value, option, _ in given.values():
        if value is not None and not (np.isfinite(value) and value > 0):
            raise Refusal(f"{option} must be positive, got {value:g}")
    return {name: value * factor for name, (value, _, factor) in given.items() if value is not None}


def _table(found):
    """path.csv: time, pose, and the six entries of its covariance."""
    upper = found.cov[:, (0, 0, 0, 1, 1, 2), (0, 1, 2, 1, 2, 2)]
    out = io.StringIO()
    np.savetxt(
        out,
        np.column_stack([found.time, found.x, upper]),
        fmt="%.6f,%.5f,%.5f,%.6f,%.4g,%.4g,%.4g,%.4g,%.4g,%.4g",
        header="t,x,y,theta,cov_xx,cov_xy,cov_xt,cov_yy,cov_yt,cov_tt",
        comments="",
    )
    return out.getvalue()


def report_of(found, landmarks, readings):
    """The page of a path: where it went, what was rejected, how honest the filter is."""
    rows = [(name, getattr(found.noise, name), unit, "fitted" if name in found.fitted else "given")
            for name, unit in zip(NAMES, UNITS)]  # fmt: skip
    nis = np.where(np.isfinite(found.nis), found.nis, 2 * LIMIT)
    sections = [
        report.paragraphs([line for line in found.lines() if not line.startswith("warning")][:1]),
        report.paragraphs(found.warnings, "warning"),
        report.section("Path", _map(found, landmarks, readings)),
        report.section(
            "NIS by reading",
            report.chart(nis, found.used, "NIS", "reading", limit=LIMIT),
            report.paragraphs([f"mean NIS of the readings used {found.mean_nis:.3f}; 2 is honest"], "muted"),
        ),
        report.section("Noise", report.table(("", "standard deviation", "unit", ""), rows)),
        report.section("Readings not used", _rejected(found, readings)),
        report.section("Against the truth", *_truth(found)),
    ]
    return report.page("Localization", [s for s in sections if s])


def _map(found, landmarks, readings):
    view = report.View(above=True)
    flat = lambda points: np.column_stack([points, np.zeros(len(points))])  # noqa: E731
    pick = np.unique(np.linspace(0, len(found.x) - 1, min(len(found.x), SHOWN_POSES)).astype(int))
    view.line(flat(found.x[pick, :2]), "estimate", 2)
    for k in pick[:: max(len(pick) // SHOWN_ELLIPSES, 1)]:
        view.line(flat(ellipse(found.x[k, :2], found.cov[k, :2, :2], 0.95, 25)), "prediction", 1)
    for name, point in zip(landmarks.ids, landmarks.points):
        view.word([*point, 0.0], f"+ {name}")
        view.line(flat(np.array([point, point])), "ink")
    view.word([*found.x[0, :2], 0.0], "start", "estimate")
    said = "the path from above, 95 % ellipses along it, and the landmarks"
    return report.paragraphs([said], "muted") + view.as_html(said)


def _rejected(found, readings):
    out = np.flatnonzero(~found.used)
    if not len(out):
        return ""
    rows = [
        (int(k) + 1, f"line {readings.lines[k]}", readings.ids[k] or "unknown", *readings.z[k], found.nis[k], why)
        for k, why in ((k, found.why[k]) for k in out[:SHOWN_ROWS])
    ]
    more = f"{len(out)} of {len(found.used)} readings; all of them stand in result.json"
    head = ("reading", "where", "id", "range [m]", "bearing [rad]", "NIS", "why")
    return report.paragraphs([more], "muted") + report.table(head, rows)


def _truth(found):
    if found.nees is None:
        return
    about, known = found.as_dict(), np.isfinite(found.nees)
    text = (
        f"position {about['rms_position']:.4g} m and heading {about['rms_heading_deg']:.4g} deg (rms); mean NEES "
        f"{about['mean_nees']:.3f}, 3 is honest"
    )
    yield report.paragraphs([text])
    distance = np.linalg.norm(found.errors[known, :2], axis=1)
    yield report.curve(found.time[known] - found.time[known][0], distance, "time [s]", "error [m]")


if __name__ == "__main__":
    sys.exit(run(main))
