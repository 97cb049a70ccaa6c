"""What crosses the border arrives as it was; what is nonsense is refused."""

import json
import re
import time

import numpy as np
import pytest

from labkit.collect import border, library, rails, sandbox, wire
from labkit.exercises import guard, source
from labkit.localization.maps import OccupancyGrid


def across(value):
    parcel = []
    return wire.decode(
        json.loads(json.dumps(wire.encode(value, parcel, []))), parcel, lambda k, name, names: (name, names)
    )


def same(a, b):
    if isinstance(a, np.ndarray):
        return isinstance(b, np.ndarray) and a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    if isinstance(a, list | tuple):
        return type(a) is type(b) and len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    return type(a) is type(b) and (a == b or (a != a and b != b))


PLAIN = [
    *(None, True, 3, -(2**70), 0.1, float("nan"), float("inf"), -0.0, "ü\ud800", b"\x00\xff", 2 - 3j),
    *(np.float64(0.1), np.int32(7), np.bool_(True), np.float32(0.1)),
    *(
        np.zeros((0, 3)),
        np.arange(12.0).reshape(3, 4).T,
        np.array(["a", "bc"]),
        np.ones((2, 2), bool),
        np.zeros((), ">i2"),
    ),
    *((1, [2.0, (3, "x")]), {"a": [1], 2: np.eye(2)}, {1, 2}, frozenset("ab"), ...),
]


@pytest.mark.parametrize("value", PLAIN, ids=range(len(PLAIN)))
def test_plain_data_arrive_bit_by_bit(value):
    assert same(value, across(value))


def test_generators_records_types_and_functions_arrive_as_what_they_are():
    rng = np.random.default_rng(3)
    rng.normal()
    assert across(rng).normal(size=3).tolist() == np.random.default_rng(3).normal(size=4).tolist()[1:]
    grid = across(OccupancyGrid(np.eye(4, dtype=np.uint8), 0.5, (1.0, 2.0)))
    assert isinstance(grid, OccupancyGrid) and grid.resolution == 0.5 and (grid.cells == np.eye(4)).all()
    assert across(np.float64) is np.float64
    assert across(lambda a, b: a) == ("<lambda>", ["a", "b"])


def test_what_cannot_cross_keeps_the_name_of_its_type_alone():
    class Evil:
        def __reduce__(self):
            return eval, ("1 / 0",)

    stranger = across(Evil())
    assert type(stranger).__name__ == "Evil" and isinstance(stranger, wire.Stranger)


@pytest.mark.parametrize(
    "word",
    [
        {},
        {"plain": 1, "list": []},
        {"array": ["O", [1], 0]},
        {"array": ["f8", [10**9], 0]},
        {"record": ["os:system", {}]},
        {"record": ["labkit.geometry.frames:invert", {}]},
        {"record": ["labkit.collect.judge:Plan", {}]},
        {"generator": ["Generator", {"plain": 1}]},
        {"pickle": "x"},
        {"set": [{"list": []}]},
        [],
    ],
    ids=range(11),
)
def test_nonsense_is_refused(word):
    with pytest.raises(Exception):  # noqa: B017 (of any kind: the border answers them all alike)
        wire.decode(word, [b"12345678"])


def test_what_is_too_large_or_too_deep_is_refused():
    deep = []
    for _ in range(100):
        deep = [deep]
    for value in (deep, np.zeros(wire.LARGEST // 8 + 1)):
        with pytest.raises(wire.BorderError):
            across(value)


def test_errors_are_rebuilt_with_their_name_and_their_kin():
    error = border.rebuilt([["LinAlgError", "ValueError", "Exception"], "Singular matrix", "line 2: x", None])
    assert isinstance(error, np.linalg.LinAlgError) and str(error) == "Singular matrix"
    assert guard._student_line(error, None) == "line 2: x"
    own = border.rebuilt([["MyError", "KeyError", "LookupError", "Exception"], "'a'", "", None])
    assert isinstance(own, KeyError) and type(own).__name__ == "MyError" and str(own) == "'a'"
    missing = border.rebuilt([["NameError", "Exception"], "name 'q' is not defined", "", "q"])
    assert missing.name == "q"
    assert isinstance(border.rebuilt([["TimeLimit"], "", "", None]), guard.TimeLimit)
    assert type(border.rebuilt([["no name!"], "x", "", None])).__name__ == "Exception"


def test_the_librarys_answers_are_found_and_its_tools_are_not():
    assert library.answers("01-frames")["invert"] == ["labkit.geometry.frames._invert", "labkit.geometry.frames.invert"]
    tracker = library.answers("06-tracker")
    assert "labkit.calibration.ax_xb.rotation_from_kronecker" in tracker["rotation_from_nullvector"]
    assert "labkit.geometry.lie.nearest_rotation" not in tracker["rotation_from_nullvector"]
    assert "labkit.estimation.optimization.cauchy_step" not in library.answers("04-optimization")["dogleg_step"]


def test_a_secret_is_one_also_within_the_own_folder(tmp_path):
    """Under bubblewrap the own folder is /tmp, where a checkout may lie."""
    secret, notes = tmp_path / "labkit" / "frames.py", tmp_path / "notes.txt"
    laid = rails.Rails([tmp_path / "labkit"], [secret], tmp_path)
    assert not laid.may_read(secret) and laid.may_read(notes) and laid.may_write(notes)


def test_what_the_exercises_of_a_chapter_are_made_of_is_hidden_but_for_what_its_notebook_shows():
    hidden = set(sandbox.hidden())
    for path in sorted((sandbox.PACKAGE / "chapters").glob("*/exercises.py")):
        own = re.findall(r"^from \.(\w*) import ([\w, ]+)", path.read_text(encoding="utf-8"), re.MULTILINE)
        parts = {part for module, names in own for part in ([module] if module else names.split(", "))}
        notebook = source.ROOT / "solutions" / f"{path.parent.name.removeprefix('ch')}.py"
        shown = re.findall(
            rf"^from labkit.chapters.{path.parent.name} import ([\w, ]+)", notebook.read_text("utf-8"), re.M
        )
        for part in {"exercises", *parts} - {name for names in shown for name in names.split(", ")}:
            assert path.with_name(f"{part}.py") in hidden, f"a submission may read {part}.py of {path.parent.name}"


def test_waiting_for_a_busy_processor_is_not_the_students_time(monkeypatch):
    now = guard.Starved.seconds()
    assert now >= 0.0 and (now > 0.0 or not guard.os.path.exists("/proc/self/schedstat"))
    began = time.monotonic()
    monkeypatch.setattr(guard.Starved, "seconds", lambda: time.monotonic() - began)
    assert guard.run(lambda: time.sleep(0.3), (), limit=0.05).error is None


def test_waiting_for_the_other_side_is_not_the_students_time():
    """A call across the border takes as long as the machine is busy; sleeping is the student's own."""

    def asks(seconds):
        with wire._undisturbed(), guard.Abroad.waiting():
            time.sleep(seconds)
        return seconds

    def rings_in_its_midst(seconds):
        """As where another thread takes the signal: it is heard before the wait is over."""
        with guard.Abroad.waiting():
            time.sleep(seconds)
        return seconds

    assert guard.run(asks, (1.2,), limit=0.5).result == 1.2
    assert guard.run(rings_in_its_midst, (0.4,), limit=0.1).result == 0.4
    assert isinstance(guard.run(asks, (0.8,), limit=0.4 / guard.ABROAD / guard.PATIENCE).error, guard.TimeLimit)
    assert isinstance(guard.run(time.sleep, (0.3,), limit=0.05).error, guard.TimeLimit)
