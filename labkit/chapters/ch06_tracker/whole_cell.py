"""The Stage of the whole cell: a part is learned and found again, one of its measurements spoiled."""

import functools
from dataclasses import replace

import numpy as np

from ...fast import cell as fast
from ...geometry.frames import moved, pose, transform
from ...geometry.lie import log_so3
from ...machines import cell
from ...machines.arm import TX40, inverse_kinematics, link_frames
from ...stage import Choice, Handle, Slider, Stage
from ...stage.scene3d import Scene, View
from ...stage.scene3d_handles import Dial, OnPlane
from . import figures as draw

ENLARGED = 30.0  # how much larger than the cell its errors are drawn
CLOUD = 400  # simulated cells
HALF_DEG, ONE_DEG = np.deg2rad([0.5, 1.0])
SPOILED = {  # source: what `spoil` = 1 puts into it, and how that is told
    "tip": ("2 mm", np.array([2.0, 0.0, 0.0])),
    "scanner": ("1 deg", np.array([0.0, ONE_DEG, 0.0, 0.0, 0.0, 0.0])),
    "tracker": ("0.5 deg", np.array([HALF_DEG, 0.0, 0.0, 0.0, 0.0, 0.0])),
    "marks": ("2 mm in the second", np.array([0, 0, 0, 0, 0, 2.0, 0, 0, 0])),
    "first reading": ("0.5 deg", np.array([0.0, HALF_DEG, 0.0, 0.0, 0.0, 0.0])),
    "second reading": ("0.5 deg", np.array([0.0, HALF_DEG, 0.0, 0.0, 0.0, 0.0])),
}
CALLED = {
    "tip": "the tip in F", "scanner": "the scanner, T_FS", "tracker": "the tracker's world, T_BW",
    "marks": "the part as learned, by its marks, T_BP0",
    "first reading": "the tracker when the part was learned, T_WE0", "second reading": "the tracker now, T_WE1",
}  # fmt: skip
NEAR = 70.0  # mm: so near to a frame a click chooses it
CELL_SEED = 6


@functools.cache
def _calibrated():
    return cell.calibrated_cell(np.random.default_rng(CELL_SEED))


@functools.cache
def _drawn():
    """Errors of the simulated cells: they hang on how sure each source is, and not on where the part stands."""
    return fast.Misses(cell.draw_errors(_calibrated(), _learned(False), np.random.default_rng(62), CLOUD))


@functools.cache
def _learned(touched):
    """The job as it was learned, which does not hang on where the part stands now."""
    return cell.simulated_job(cell.FAR, touched=touched)


def _part_now(state):
    return np.array([*state["P"][:2], np.deg2rad(state["turn"])])


def _used(state):
    """The job as the true cell would measure it, and the cell and job that are used, one source of them spoiled."""
    now = cell.true_reading(cell.place_on_table(*_part_now(state)))
    job = replace(_learned(state["marks"] == "touched with the tip"), T_WE1=now)
    source = state["source"]
    return job, *fast.with_errors(_calibrated(), job, {source: state["spoil"] * SPOILED[source][1]})


def _source_places(of, job, T_BF):
    """Where each source shows in the base with the flange at T_BF, a pose (4, 4)."""
    tip = pose(T_BF[:3, :3], transform(T_BF, of.tip))
    readings = (of.T_BW @ job.T_WE0, of.T_BW @ job.T_WE1)
    return dict(zip(cell.SOURCES, (tip, T_BF @ of.T_FS, of.T_BW, fast.learned_pose(of, job), *readings)))


def _known(of, job, source):
    """Covariance (3, 3), mm^2, of the place at which a source shows."""
    if source == "tip":
        return job.R_tool @ of.cov_tip @ job.R_tool.T
    return cell.frame_in_base(of, job, draw.SHOWN[source])[1][3:, 3:]


def _enlarged(T, to):
    """A pose that is as far from T as `to` is, ENLARGED times."""
    turn = log_so3(T[:3, :3].T @ to[:3, :3])
    return moved(T, ENLARGED * np.concatenate([turn, to[:3, 3] - T[:3, 3]]))


def compute_whole_cell(state):
    """A part that was learned and is found again with all calibrations of the cell, one of them spoiled.

    Returns a dictionary: cell and job that are used, q (6,) of the arm at the hole and whether it gets there, T_BF,
    part, learned and found (4, 4), found with its error enlarged; hole (3,), miss (3,) mm of the tip, sizes {source:
    mm} and their total, covariance (3, 3) and cloud (m, 3) of the miss to be expected; of the chosen source its place
    as used (4, 4), with its error enlarged, and its covariance (3, 3); frames {source: (4, 4)} and
    places {source: (3,)} that can be clicked.
    """
    job, used, measured = _used(state)
    T_BF = fast.flange_at_hole(used, measured)
    true, there = _source_places(cell.TRUTH, job, T_BF), _source_places(used, measured, T_BF)
    start = np.array([np.arctan2(T_BF[1, 3], T_BF[0, 3]), *np.deg2rad([40.0, 100.0, 0.0, 40.0, 0.0])])
    q, reached = inverse_kinematics(TX40, T_BF, start)
    shares = fast.miss_budget(used, measured)
    cov, part = sum(shares.values()), cell.place_on_table(*_part_now(state))
    source, hole = state["source"], transform(part, cell.HOLE)
    return {
        "cell": used, "job": measured, "q": q, "reached": bool(reached), "T_BF": T_BF, "part": part,
        "turn": float(np.deg2rad(state["turn"])), "learned": cell.place_on_table(*cell.LEARNED),
        "found": _enlarged(part, fast.part_pose(used, measured)),
        "hole": hole, "miss": transform(T_BF, cell.TRUTH.tip) - hole,
        "sizes": cell.sizes(shares), "total": float(np.sqrt(np.trace(cov))), "covariance": cov,
        "cloud": _drawn().of(used, measured), "source": source,
        "spoiled": state["spoil"], "place": there[source], "known": _known(used, measured, source),
        "off": _enlarged(true[source], there[source]), "frames": there | {"part": part},
        "places": {name: T[:3, 3] for name, T in there.items()},
    }  # fmt: skip


def chosen_by_click(state, moved):
    """A click on a frame of the cell, or near it, chooses its source."""
    if "click" not in moved or state["click"] is None:
        return {}
    _, used, measured = _used(state)
    seen = {
        name: np.linalg.norm(state["view"].project(T[:3, 3])[:2] - state["click"])
        for name, T in _source_places(used, measured, fast.flange_at_hole(used, measured)).items()
    }
    nearest = min(seen, key=seen.get)
    return {"source": nearest} if seen[nearest] < NEAR else {}


def _cell_sentence(result):
    source, miss = result["source"], np.linalg.norm(result["miss"])
    std = np.sqrt(np.trace(result["known"]))
    told = f"{CALLED[source][0].upper()}{CALLED[source][1:]}: known to {std:.2f} mm"
    if result["spoiled"]:
        told += f", spoiled by {result['spoiled']:.1f} times {SPOILED[source][0]}"
    verdict = " Far more than the budget admits." if miss > 4 * result["total"] else ""
    arm = "" if result["reached"] else " The arm itself does not get there."
    return f"{told}. The tip misses by {miss:.1f} mm; {result['total']:.2f} mm is to be expected.{verdict}{arm}"


def _part_circle(result):
    """Where the dial of the part's turn has its circle."""
    return pose(np.eye(3), result["part"][:3, 3]), draw.TURN_RADIUS


def whole_cell():
    """One cell from beginning to end: move the part, click a transform, spoil it, watch part, budget and miss."""

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(2.2, 1))
        title = f"all errors x {ENLARGED:.0f}, ellipsoids 3 std"
        space = Scene(left, radius=410, half_width=460, title=title, floor=0.0, unit="mm")
        picture = draw.CellScene(space, cell)
        bars = draw.Budget(right, cell.SOURCES)

        def update(state, result):
            picture.set(result, link_frames(TX40.dh, result["q"]), ENLARGED)
            space.draw(state["view"])
            bars.set(result["sizes"], result["total"])

        return [*space.artists, *bars.artists], update

    start = (*cell.FAR[:2], cell.TABLE)
    return Stage(
        "the whole cell",
        scene=scene,
        compute=compute_whole_cell,
        handles={
            "P": Handle(
                start, step=20, bounds=((-120.0, 260.0), (-260.0, 280.0), (cell.TABLE, cell.TABLE)), label="part",
                way=OnPlane(),
            ),
            "turn": Dial(86.0, -45.0, 120.0, _part_circle, label="turn of the part"),
        },
        controls={
            "source": Choice(list(SPOILED), "tracker", label="transform"),
            "spoil": Slider(0.0, 2.0, 0.0, step=0.1, label="spoiled"),
            "marks": Choice(["seen by the scanner", "touched with the tip"], "seen by the scanner", label="marks"),
        },
        click=0,
        constrain=chosen_by_click,
        view=View(24, 28, center=(120.0, 75.0, 190.0), eye=2800.0),
        fail={"source": "tracker", "spoil": 1.0},
        presets={
            "back where it was learned": {
                "P": (*cell.LEARNED[:2], cell.TABLE), "turn": float(np.rad2deg(cell.LEARNED[2]).round())
            }
        },
        describe=_cell_sentence,
        size=(7.6, 4.6),
    )  # fmt: skip
