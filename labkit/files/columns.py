"""What a column means, from its title: `tx`, `pose.position.x`, `p_RS_R_x [m]` and `X (mm)` are all an x."""

import re
from dataclasses import dataclass

from .text import FileError

LENGTHS = {"m": 1000.0, "mm": 1.0, "meter": 1000.0, "meters": 1000.0, "millimeter": 1.0, "millimeters": 1.0}
TIMES = {"s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
ANGLES = {"deg": "deg", "degrees": "deg", "°": "deg", "rad": "rad", "radians": "rad"}
UNITS = (LENGTHS, TIMES, ANGLES)
PLAIN = {
    "time": "t time timestamp stamp timestamps secs seconds sec",
    "group": "group set session series station cell",
    "stop": "stop",
    "id": "id subject landmark marker tag beacon name",
    "range": "range distance dist r",
    "bearing": "bearing phi angle azimuth",
    "v": "v speed velocity linear v_x vx linear_x linear.x twist.linear.x",
    "omega": "omega w yaw_rate yawrate turn_rate angular wz w_z omega_z angular_z angular.z twist.angular.z",
    "theta": "theta yaw heading psi",
    "a": "a",
    "b": "b",
    "c": "c",
    "rx": "rx rot_x rotvec_x",
    "ry": "ry rot_y rotvec_y",
    "rz": "rz rot_z rotvec_z",
}
WORDS = {word: meaning for meaning, words in PLAIN.items() for word in words.split()}
ORIENTED = re.compile(r"(^|[._ /])(q|quat|quaternion|orientation|rot|rotation)[._ /]?(\w+[._ /])*[xyzw]$|^q_?[xyzw]$")
PLACED = re.compile(r"(^|[._ /])(p|t|pos|position|trans|translation)[._ /]?(\w+[._ /])*[xyz]$|^[xyz]$|^[pt]_?[xyz]$")


@dataclass(frozen=True)
class Column:
    """A column: where it stands, what it means, and the unit its title names (or None)."""

    index: int
    meaning: str
    unit: str | None


def split_unit(title):
    """(title without its unit, unit or None): `x [mm]`, `x (mm)`, `x_mm` and `x/mm` all give ("x", "mm")."""
    title = title.strip().strip("\"'%#").lower()
    match = re.fullmatch(r"(.*?)\s*[\[(]\s*([^\])]*?)\s*[\])]", title) or re.fullmatch(
        r"(.+?)[_/ ](mm|m|deg|rad)", title
    )
    if not match:
        return title, None
    return match[1].strip(), match[2].removesuffix("/s") or None


def meaning(title):
    """What a title without its unit means: time, x, qw, a, rx, m12 and so on; None when it is not known."""
    if title in WORDS:
        return WORDS[title]
    if ORIENTED.search(title):
        return "q" + title[-1]
    if PLACED.search(title):
        return title[-1]
    match = re.fullmatch(r"(?:[a-z]+_?)?([0-4])[,_]?([0-4])", title)
    return f"m{match[1]}{match[2]}" if match else None


def columns_of(table, needed=()):
    """{meaning: Column} of a table, and the titles that mean nothing here; both empty without titles.

    Titles from a comment count only when all `needed` are among them: such a line may say anything.

    Raises
    ------
    FileError
        When two titles mean the same, or a unit is unknown.
    """
    found, ignored = {}, []
    for index, title in enumerate(table.titles or ()):
        plain, unit = split_unit(title)
        name = meaning(plain)
        if name is None:
            ignored.append(title)
            continue
        if name in found:
            if table.from_comment:
                return {}, ()
            other = table.titles[found[name].index]
            raise FileError(f"{table.name}: the columns {other!r} and {title!r} both mean {name}")
        known = next((units for units in UNITS if unit in units), None)
        if name in ("x", "y", "z") and unit is not None and known is not LENGTHS:
            raise FileError(f"{table.name}: lengths must be in m or mm, but column {title!r} says {unit!r}")
        found[name] = Column(index, name, unit if known else None)
    if table.from_comment and not set(needed) <= set(found):
        return {}, ()
    return found, tuple(ignored)


def one_unit(table, columns, names, units):
    """The unit that the titles of these columns name, or None; refuses two different ones."""
    said = {columns[name].unit for name in names if columns[name].unit in units}
    if len(said) > 1:
        raise FileError(f"{table.name}: {', '.join(names)} must share one unit, got {' and '.join(sorted(said))}")
    return said.pop() if said else None


def need(table, columns, names, what):
    """Refuse a table without one of these columns."""
    missing = [name for name in names if name not in columns]
    if missing:
        titles = ", ".join(table.titles)
        raise FileError(f"{table.name}: {what} needs a column {missing[0]!r}, but the header has {titles[:120]}")
