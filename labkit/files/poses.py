"""Poses from a file in any of the usual notations, with what was assumed about them.

quaternion  x y z qx qy qz qw in named columns of any order
tum         t x y z qx qy qz qw without header
kuka        x y z A B C, Rz(A) Ry(B) Rx(C), degrees
ur          x y z rx ry rz, a rotation vector in radians
matrix      4 x 4 or 3 x 4 row-major, one per line or in blocks of four lines
folder      text files of one 4 x 4 each, in the order of their numbers
json        a list of 4 x 4, or of pairs of 4 x 4 (robot first), or of samples as MoveIt names them

Positions come back in the unit of the file; `Poses.length` says which one it is.
"""

import json
import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..geometry.frames import kuka_from_degrees, matrix_from_kuka, matrix_from_quaternion, pose
from ..geometry.lie import exp_so3, nearest_rotation
from .columns import ANGLES, LENGTHS, TIMES, columns_of, need, one_unit
from .text import FileError, read_table, read_text, shown

FORMATS = ("quaternion", "tum", "kuka", "ur", "matrix", "folder", "json")
QUATERNION_TOLERANCE = 0.01  # of its length: three printed digits pass
ROTATION_TOLERANCE = 5e-3  # of R'R: matrices printed with three digits pass
LARGEST = {"m": 60.0, "mm": 60_000.0}  # no robot and no tracker measures farther
SMALLEST = {"m": 1e-4, "mm": 5.0}  # poses that all lie within this of the origin are in another unit
SWITCH = (10.0, 50.0)  # positions within the first are meters, beyond the second millimeters; between, it is asked
DEFAULT_LENGTH = {"kuka": "mm"}  # of a file that does not say
NAMED = {
    "quaternion": ("x", "y", "z", "qx", "qy", "qz", "qw"),
    "kuka": ("x", "y", "z", "a", "b", "c"),
    "ur": ("x", "y", "z", "rx", "ry", "rz"),
}
PAIR_KEYS = (("effector_wrt_world", "object_wrt_sensor"), ("robot", "sensor"), ("T_BF", "T_ST"))


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses of one file.

    T: (n, 4, 4). time: (n,) s or None. group: (n,) or None. places: where each stands, "line 7" or "pose_007.txt".
    format, length ("m" or "mm"): as recognized or told. assumed: the same in one line.
    """

    name: str
    T: np.ndarray
    time: np.ndarray | None
    group: np.ndarray | None
    places: tuple
    format: str
    length: str
    assumed: str

    def __len__(self):
        return len(self.T)

    def in_unit(self, length):
        """The same poses with positions in m or mm."""
        if length == self.length:
            return self
        T = self.T.copy()
        T[:, :3, 3] *= LENGTHS[self.length] / LENGTHS[length]
        return replace(self, T=T, length=length)


def read_poses(path, format=None, length=None, angle=None, quaternion=None, any_size=False):
    """Poses of a file or folder.

    Parameters
    ----------
    path : str or Path
    format : str, optional
        One of `FORMATS`; recognized by header and number of columns without it.
    length : {"m", "mm"}, optional
        Unit of the positions. A title such as `x [mm]` says it as well; otherwise it is judged by their size.
    angle : {"deg", "rad"}, optional
        Unit of A, B, C (default degrees) or of the rotation vector (default radians).
    quaternion : {"xyzw", "wxyz"}, optional
        Order in columns without titles; xyzw without it.
    any_size : bool
        Accept positions that are implausible in the unit said.

    Returns
    -------
    Poses

    Raises
    ------
    FileError
        One sentence with file and line.
    """
    path = Path(path)
    _refuse_word(format, FORMATS, "--format")
    if path.is_dir():
        found = _from_folder(path)
    elif format == "json" or (format is None and path.suffix.lower() == ".json"):
        found = _from_json(path)[0]
    else:
        found = _from_table(path, format, angle, quaternion)
    return _with_unit(found, length, any_size)


def read_pairs(path, length=None, any_size=False):
    """Robot and sensor poses from one JSON file of pairs: (Poses, Poses)."""
    both = _from_json(Path(path))
    if len(both) != 2:
        raise FileError(f"{Path(path).name}: expected pairs of 4 x 4 matrices, robot first, got single ones")
    unit = length or _judge_length(both, any_size)
    return tuple(_with_unit(poses, unit, any_size) for poses in both)


def _refuse_word(word, words, option):
    if word is not None and word not in words:
        raise FileError(f"{option} must be one of {', '.join(words)}, got {word!r}")


# --- tables ----------------------------------------------------------------------------------------------------------


def _from_table(path, format, angle, quaternion):
    table = read_table(path)
    columns, ignored = columns_of(table, NAMED["quaternion"] if table.width > 6 else ())
    if columns and ("x" in columns or "m11" in columns or "m00" in columns) and format != "matrix":
        kind, picked = _by_titles(table, columns, format)
    else:
        kind, picked, columns = *_by_count(table, format), {}
    places = tuple(f"line {line}" for line in table.lines)
    time = _times(table, columns, picked)
    unit = one_unit(table, columns, [n for n in "xyz" if n in columns], LENGTHS) if columns else None
    values = table.numbers(picked["values"])
    _refuse_infinite(table, values)
    if kind == "matrix":
        T, places = _matrices(table, values, places)
        how = "matrices row by row"
    elif kind == "quaternion":
        order = "xyzw" if columns else quaternion or "xyzw"
        T = _from_quaternions(table, values, order)
        how = f"quaternion {order}" + ("" if columns or quaternion else " (assumed)")
    else:
        said = one_unit(table, columns, NAMED[kind][3:], ANGLES) if columns else None
        T, how = _from_angles(table, values, kind, angle or (ANGLES[said] if said else None))
    name = "tum" if kind == "quaternion" and not columns and time is not None else kind
    group = table.numbers([columns["group"].index])[:, 0] if "group" in columns else None
    if group is None and "stop" in columns:
        group = table.numbers([columns["stop"].index])[:, 0]
    kind_said = how if how.startswith(name) else f"{name}, {how}"
    said = f"{kind_said}, columns " + ("by their titles" if columns else "by their number")
    if ignored and columns:
        said += f", not used: {', '.join(ignored)[:80]}"
    return Poses(table.name, T, time, group, places, name, unit and ("m" if LENGTHS[unit] > 1 else "mm"), said)


def _by_titles(table, columns, format):
    """(kind, picked columns) of a table with titles."""
    if "m11" in columns or "m00" in columns:
        return "matrix", {"values": _matrix_columns(table, columns)}
    format = "quaternion" if format == "tum" else format
    kinds = [format] if format in NAMED else [k for k in NAMED if NAMED[k][-1] in columns or NAMED[k][3] in columns]
    if not kinds:
        raise FileError(
            f"{table.name}: positions, but no orientations: expected columns qx qy qz qw, or A B C, or rx ry rz"
        )
    if len(kinds) > 1:
        raise FileError(f"{table.name}: the header fits {' and '.join(kinds)}: say which with --format")
    need(table, columns, NAMED[kinds[0]], f"format {kinds[0]}")
    return kinds[0], {"values": [columns[name].index for name in NAMED[kinds[0]]]}


def _matrix_columns(table, columns):
    """Indices of twelve numbers row by row, from titles m11 ... m34 or m00 ... m23, or r11 ... r33 with x y z."""
    first = 0 if "m00" in columns else 1
    names = [[f"m{i + first}{j + first}" for j in range(3)] for i in range(3)]
    lasts = [f"m{i + first}{3 + first}" for i in range(3)]
    lasts = lasts if lasts[0] in columns else ["x", "y", "z"]
    names = [name for row, last in zip(names, lasts) for name in (*row, last)]
    need(table, columns, names, "a matrix")
    return [columns[name].index for name in names]


def _by_count(table, format):
    """(kind, picked columns) of a table without titles."""
    width = table.width
    time = None
    if format == "tum" or (format is None and width == 8):
        kind, time = "quaternion", 0
    elif format in ("kuka", "ur"):
        kind, time = format, (0 if width == 7 else None)
    elif format == "quaternion":
        kind, time = "quaternion", (0 if width == 8 else None)
    elif format == "matrix" or (format is None and width in (4, 12, 13, 16, 17)):
        kind, time = "matrix", (0 if width in (13, 17) else None)
    elif width == 7:
        kind = "quaternion"
    elif width == 6:
        kind = _angles_by_size(table)
    else:
        raise FileError(
            f"{table.name}, line {table.lines[0]}: {width} columns without a known header are no pose: expected 6 "
            "(KUKA or UR), 7 or 8 (quaternion), 12 or 16 (matrix), or titles such as x y z qx qy qz qw"
        )
    wanted = {"quaternion": (7,), "kuka": (6,), "ur": (6,), "matrix": (4, 12, 16)}[kind]
    left = width - (time is not None)
    if left not in wanted:
        more = " behind the time" if time is not None else ""
        raise FileError(
            f"{table.name}, line {table.lines[0]}: format {format or kind} needs {' or '.join(map(str, wanted))} "
            f"columns{more}, got {left}"
        )
    return kind, {"time": time, "values": list(range(width - left, width))}


def _angles_by_size(table):
    if np.abs(table.numbers([3, 4, 5])).max() > 2 * np.pi + 0.3:
        return "kuka"
    raise FileError(
        f"{table.name}: six columns without a header may be x y z A B C or a rotation vector: "
        "say --format kuka or --format ur"
    )


def _times(table, columns, picked):
    if "time" in columns:
        column = columns["time"]
        time = table.numbers([column.index])[:, 0] * TIMES.get(column.unit, 1.0)
        if column.unit is None and len(time) > 1 and np.median(np.abs(np.diff(time))) > 1e5:
            time = time * 1e-9  # nobody samples every 28 hours: these are nanoseconds
    elif picked.get("time") is not None:
        time = table.numbers([picked["time"]])[:, 0]
    else:
        return None
    bad = ~np.isfinite(time)
    if bad.any():
        raise FileError(f"{table.name}, line {table.lines[np.argmax(bad)]}: the time is not finite")
    return time


def refuse_times(poses):
    """Refuse a stream without times, with doubled ones, or with times that run backwards."""
    if poses.time is None:
        raise FileError(f"{poses.name}: a stream needs a time in every row: a column t, or the TUM format")
    step = np.diff(poses.time)
    for bad, what in ((step == 0, "the same time as the row before"), (step < 0, "a time before that of the last row")):
        if bad.any():
            k = int(np.argmax(bad)) + 1
            raise FileError(f"{poses.name}, {poses.places[k]}: {what}, {poses.time[k]:.6f}")


def refuse_other_rows(first, second):
    """Refuse two files, of poses or of points, whose rows do not belong together one by one."""
    if len(first) != len(second):
        raise FileError(
            f"{first.name} has {len(first)} rows and {second.name} has {len(second)}: they must come row by row "
            "(two streams with times are aligned by: calibrate compare)"
        )
    if getattr(first, "format", "") == getattr(second, "format", None) == "folder" and first.places != second.places:
        numbers = [[int("".join(filter(str.isdigit, p)) or 0) for p in poses.places] for poses in (first, second)]
        if numbers[0] != numbers[1]:
            raise FileError(
                f"the numbers of the files in {first.name} and {second.name} differ: which belong together?"
            )


def _refuse_infinite(table, values):
    bad = ~np.isfinite(values).all(axis=1) | (np.abs(np.nan_to_num(values)) > 1e12).any(axis=1)
    if bad.any():
        k = int(np.argmax(bad))
        entry = values[k][~(np.abs(values[k]) <= 1e12)][0]
        raise FileError(f"{table.name}, line {table.lines[k]}: expected a finite number, got {entry:g}")


def _from_quaternions(table, values, order):
    q = values[:, 3:] if order == "xyzw" else np.roll(values[:, 3:], -1, axis=1)
    length = np.linalg.norm(q, axis=1)
    bad = np.abs(length - 1) > QUATERNION_TOLERANCE
    if bad.any():
        k = int(np.argmax(bad))
        raise FileError(f"{table.name}, line {table.lines[k]}: the quaternion has length {length[k]:.4g}, not 1")
    return pose(matrix_from_quaternion(q), values[:, :3])


def _from_angles(table, values, kind, unit):
    turns = np.abs(values[:, 3:])
    default = "deg" if kind == "kuka" else "rad"
    if (
        unit is None
        and kind == "kuka"
        and len(values) > 2
        and turns.max() < 3.2
        and np.ptp(values[:, 3:], 0).max() > 0.3
    ):
        raise FileError(
            f"{table.name}: A, B and C stay within {turns.max():.2f}: are they radians? Say --angle rad or --angle deg"
        )
    if (unit or default) == "rad" and turns.max() > 2 * np.pi + 0.3:
        k = int(np.argmax(turns.max(axis=1)))
        raise FileError(
            f"{table.name}, {'line'} {table.lines[k]}: an angle of {turns[k].max():.4g} rad is more than one turn: "
            "are they degrees? Say --angle deg"
        )
    how = f"angles in {unit or default}" + ("" if unit else " (assumed)")
    factor = np.pi / 180 if (unit or default) == "deg" else 1.0
    if kind == "kuka":
        pose6 = kuka_from_degrees(values) if factor != 1.0 else values
        return matrix_from_kuka(pose6), how
    return pose(exp_so3(values[:, 3:] * factor), values[:, :3]), how


# --- matrices, folders, JSON -----------------------------------------------------------------------------------------


def _matrices(table, values, places):
    """Transforms from rows of 12 or 16 numbers, or from blocks of four rows of four."""
    if values.shape[1] == 4:
        if len(values) % 4:
            raise FileError(f"{table.name}: {len(values)} rows of four are no blocks of 4 x 4 matrices")
        values, places = values.reshape(-1, 16), places[::4]
    if values.shape[1] == 12:
        values = np.concatenate([values, np.tile([0.0, 0.0, 0.0, 1.0], (len(values), 1))], axis=1)
    return _rigid(table.name, values.reshape(-1, 4, 4), places), places


def _rigid(name, T, places):
    """Transforms that are rigid up to printed digits, their rotations made exact; the others are refused."""
    T = np.array(T, float)
    for k in range(len(T)):
        where = f"{name}, {places[k]}"
        if not np.isfinite(T[k]).all():
            raise FileError(f"{where}: expected finite numbers, got {T[k][~np.isfinite(T[k])][0]:g}")
        if np.abs(T[k, 3] - [0, 0, 0, 1]).max() > 1e-6:
            row = " ".join(f"{v:g}" for v in T[k, 3])
            hint = ": is it written column by column?" if np.abs(T[k, :, 3] - [0, 0, 0, 1]).max() < 1e-6 else ""
            raise FileError(f"{where}: the last row of a matrix must be 0 0 0 1, got {row}{hint}")
        error = np.abs(T[k, :3, :3].T @ T[k, :3, :3] - np.eye(3)).max()
        if error > ROTATION_TOLERANCE:
            raise FileError(f"{where}: the matrix is no rotation, R'R differs from I by {error:.2g}")
        if np.linalg.det(T[k, :3, :3]) < 0:
            raise FileError(f"{where}: the matrix is left-handed, its determinant is -1")
    if len(T):
        T[:, :3, :3], T[:, 3] = nearest_rotation(T[:, :3, :3]), (0, 0, 0, 1)
    return T


def _from_folder(path):
    """One 4 x 4 per file, in the order of the last number in the names."""
    numbered = {}
    for file in sorted(path.iterdir()):
        digits = re.findall(r"\d+", file.stem)
        if file.is_file() and file.suffix.lower() in (".txt", ".csv", ".dat", ".mat4", "") and digits:
            if int(digits[-1]) in numbered:
                other = numbered[int(digits[-1])].name
                raise FileError(f"{path.name}: {other} and {file.name} have the same number {int(digits[-1])}")
            numbered[int(digits[-1])] = file
    if not numbered:
        raise FileError(f"{path.name}: the folder holds no text files with numbers in their names")
    T, places = [], []
    for number in sorted(numbered):
        table = read_table(numbered[number])
        values = table.numbers()
        if values.size != 16:
            raise FileError(f"{path.name}/{table.name}: expected 4 rows of 4 numbers, got {values.size} numbers")
        T.append(values.reshape(4, 4))
        places.append(numbered[number].name)
    return Poses(path.name, _rigid(path.name, T, places), None, None, tuple(places), "folder", None, "folder of 4 x 4")


def _from_json(path):
    """One `Poses`, or two when the file holds pairs."""
    try:
        content = json.loads(read_text(path), parse_int=float)  # a number of any length: too large ones are infinite
    except (json.JSONDecodeError, RecursionError) as error:
        line = f", line {error.lineno}" if isinstance(error, json.JSONDecodeError) else ""
        raise FileError(f"{path.name}{line}: this is not JSON") from None
    if isinstance(content, dict):
        content = next((value for key, value in content.items() if isinstance(value, list)), content)
    if not isinstance(content, list) or not content:
        raise FileError(f"{path.name}: expected a list of 4 x 4 matrices, or of pairs of them")
    keys = next((k for k in PAIR_KEYS if isinstance(content[0], dict) and set(k) <= set(content[0])), None)
    stacks, places = [], tuple(f"entry {k + 1}" for k in range(len(content)))
    for place, entry in zip(places, content):
        if keys:
            entry = [entry.get(key) for key in keys] if isinstance(entry, dict) else entry
        stacks.append(_matrices_in(path.name, place, entry))
    if len({len(stack) for stack in stacks}) > 1:
        k = next(k for k, stack in enumerate(stacks) if len(stack) != len(stacks[0]))
        raise FileError(f"{path.name}, entry {k + 1}: expected {len(stacks[0])} matrices as in entry 1")
    how = "json, pairs of 4 x 4, robot first" if len(stacks[0]) == 2 else "json, list of 4 x 4"
    return [
        Poses(path.name, _rigid(path.name, np.array(stack), places), None, None, places, "json", None, how)
        for stack in zip(*stacks)
    ]


def _matrices_in(name, place, entry):
    """One or two 4 x 4 arrays of an entry: nested lists or sixteen numbers each."""
    try:
        array = np.array(entry, dtype=float)
    except (TypeError, ValueError):
        array = None
    if array is not None:
        if array.shape in ((4, 4), (16,)):
            return [array.reshape(4, 4)]
        if array.shape in ((2, 4, 4), (2, 16)):
            return list(array.reshape(2, 4, 4))
    got = f"an array of shape {array.shape}" if array is not None and array.ndim else shown(str(entry))
    raise FileError(f"{name}, {place}: expected a 4 x 4 matrix or a pair of them, got {got}")


# --- units -----------------------------------------------------------------------------------------------------------


def _reach(poses):
    return float(np.linalg.norm(poses.T[:, :3, 3], axis=1).max(initial=0.0))


def _judge_length(stacks, any_size):
    """m or mm by the size of the positions; asked where both are possible."""
    reach = max(_reach(poses) for poses in stacks)
    if reach <= SWITCH[0]:
        return "m"
    if reach >= SWITCH[1] or any_size:
        return "mm"
    raise FileError(
        f"{stacks[0].name}: positions reach {reach:.4g}, which may be m or mm: say --length m or --length mm"
    )


def _with_unit(poses, length, any_size):
    """The poses with their unit: of the header, as told, by default of the format, or by their size."""
    _refuse_word(length, ("m", "mm"), "--length")
    unit, why = poses.length or length, "" if not poses.length else " (header)"
    if unit is None:
        unit, why = DEFAULT_LENGTH.get(poses.format) or _judge_length([poses], any_size), " (assumed)"
    reach = _reach(poses)
    if not any_size and len(poses) and (reach > LARGEST[unit] or 0 < reach < SMALLEST[unit]):
        other = "mm" if unit == "m" else "m"
        raise FileError(
            f"{poses.name}: positions reach {reach:.4g} {unit}, which no robot does: are they {other}? Say --length "
            f"{other}, or --any-size if it is so"
        )
    return replace(poses, length=unit, assumed=f"{poses.name}: {len(poses)} poses, {poses.assumed}, {unit}{why}")
