"""An argument of another kind or shape than the docstring says is refused; what it says is let through."""

from dataclasses import fields

import numpy as np
import pytest

from labkit.documented import documented, unchecked
from labkit.localization import drives, path
from labkit.machines import log
from labkit.machines.simulation import MOVING, Tracker, follow_path


@documented
def measure(T, x, rng, tracker=None, model="euler", grid=None, times=None):
    """One measurement.

    Parameters
    ----------
    T : array, shape (k, 4, 4)
        Poses.
    x, times : array, shape (3,) or (n, 3)
        NaN where nothing was seen.
    rng : numpy.random.Generator
    tracker : Tracker, optional
    model : {"euler", "arc"}
        As in `step`.
    grid : Tracker
        Or anything with `cast(poses)`.

    Returns
    -------
    x : array
    """
    return x


RNG, T, X = np.random.default_rng(0), np.tile(np.eye(4), (2, 1, 1)), np.zeros(3)


class Caster:
    def cast(self, poses):
        return poses


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"T": np.zeros((4, 4))}, r"T must have shape \(k, 4, 4\), got \(4, 4\)"),
        ({"T": np.full((2, 4, 4), np.nan)}, "T must be finite"),
        ({"T": np.ones((2, 4, 4))}, "T must have the last row 0 0 0 1"),
        ({"T": None}, "T must hold real numbers, got None"),
        ({"x": np.zeros((3, 2))}, r"x must have shape \(3,\) or \(n, 3\), got \(3, 2\)"),
        (
            {"rng": 5},
            r"rng must be a numpy.random.Generator, as default_rng\(seed\) gives it, got an object of type int",
        ),
        ({"rng": None}, r"rng must be a numpy.random.Generator, as default_rng\(seed\) gives it, got None"),
        ({"tracker": "Vive"}, "tracker must be of type Tracker, got an object of type str"),
        ({"model": "none"}, "model must be one of euler, arc, got 'none'"),
        ({"model": None}, "model must be one of euler, arc, got None"),
        ({"grid": 1.0}, "grid must be of type Tracker, or have `cast`, got an object of type float"),
    ],
)
def test_what_the_docstring_does_not_say_is_refused(change, words):
    with pytest.raises(ValueError, match=words):
        measure(**({"T": T, "x": X, "rng": RNG} | change))


def test_what_it_says_arrives():
    gaps = np.array([[1.0, np.nan, 2.0]])
    assert measure(T, gaps, RNG, MOVING, "arc", Caster()) is gaps
    assert measure(T.tolist(), X.tolist(), rng=RNG, tracker=Tracker()).dtype == float
    assert measure.__wrapped__ is not measure and measure.__doc__.startswith("One measurement")


@documented
def select(
    R, cov, r, kept, rows=None, count=3, robot=None, given=(None, None), normal=None, free=(), ways=None, way=abs
):
    """Arguments whose letters, kinds and names say more than their shapes.

    Parameters
    ----------
    R : array, shape (3, 3)
    cov : array, shape (2, 2)
    r : array, shape (n, 2)
    kept : bool array, shape (n,)
    rows : array of int, shape (m,), optional
    count : int
        At least 1.
    robot : array, shape (4, 4), optional
    given : tuple
    normal : array, shape (..., p, p), optional
    free : tuple of str, optional
    ways : dict of functions, optional
    way : function (x) -> float or None
    """
    return kept, rows, count


GOOD = {"R": np.eye(3), "cov": np.eye(2), "r": np.zeros((4, 2)), "kept": [True, False, True, True]}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"R": np.ones((3, 3))}, "R must have an orthonormal rotation block"),
        ({"cov": [[1.0, 2.0], [2.0, 1.0]]}, "cov must be positive definite or singular"),
        ({"kept": [True, False]}, r"kept must have n = 4 as r has, got shape \(2,\)"),
        ({"kept": [1, 0, 1, 1]}, "kept must hold truth values, got numbers"),
        ({"kept": [[True], []]}, "kept must hold truth values, got rows of different lengths"),
        ({"rows": [0.5]}, "rows must hold whole numbers"),
        ({"count": 0}, "count must be a whole number, at least 1, got 0"),
        ({"count": 1.5}, "count must be a whole number, at least 1, got 1.5"),
        ({"count": np.timedelta64(3, "s")}, "count must hold real numbers, got durations"),
        ({"count": True}, "count must hold real numbers, got truth values"),
        ({"robot": np.diag([1.0, 1.0, -1.0, 1.0])}, "robot must be right-handed"),
        ({"given": 5}, "given must be of type tuple, got an object of type int"),
        ({"r": np.ma.array(np.zeros((4, 2)), mask=np.eye(4, 2))}, "r must hold real numbers, got masked entries"),
        ({"kept": np.ma.array([True] * 4, mask=[1, 0, 0, 0])}, "kept must hold truth values, got masked entries"),
        ({"kept": np.zeros(0, object)}, "kept must hold truth values, got nothing"),
        ({"rows": [1.0, [2.0]]}, "rows must hold real numbers, got rows of different lengths"),
        ({"free": "std"}, "free must be of type tuple, got an object of type str"),
        ({"free": None}, "free must be of type tuple, got None"),
        ({"free": ("std", 5)}, "each entry of free must be of type str, got an object of type int"),
        ({"ways": {"one": abs, "two": 5}}, "each entry of ways must be a function, got an object of type int"),
        ({"way": None}, "way must be a function, got None"),
        ({"ways": abs}, "ways must be of type dict, got an object of type builtin_function_or_method"),
        ({"normal": np.zeros((5, 3, 2))}, r"normal must have shape \(\.\.\., p, p\), got \(5, 3, 2\)"),
        ({"normal": np.zeros(2)}, r"normal must have shape \(\.\.\., p, p\), got \(2,\)"),
    ],
)
def test_letters_kinds_and_names_are_kept(change, words):
    with pytest.raises(ValueError, match=words):
        select(**(GOOD | change))


def test_a_mask_that_hides_nothing_is_none():
    assert type(measure(T, np.ma.array(X), RNG, Tracker(), grid=Caster())) is np.ndarray


def test_whole_numbers_and_truth_values_arrive_as_such():
    kept, rows, count = select(**GOOD, rows=[2.0, 0], count=2.0, free=("std",), ways={"one": abs})
    assert kept.dtype == bool and rows.dtype.kind == "i" and (count, type(count)) == (2, int)
    assert unchecked(select)(1, 2, 3, "anything") == ("anything", None, 3)


def test_a_function_of_the_library_keeps_its_word():
    with pytest.raises(ValueError, match="tracker must be of type Tracker, got None"):
        follow_path(np.arange(2.0), T, None, RNG)


@documented
def weigh(x, cov):
    """Two arguments on one line.

    Parameters
    ----------
    x, cov : arrays, shapes (3,) and (3, 3)
    """
    return x, cov


def test_each_of_several_names_has_a_shape_of_its_own():
    assert weigh(X, np.eye(3))[0] is X
    with pytest.raises(ValueError, match=r"x must have shape \(3,\), got \(3, 3\)"):
        weigh(np.eye(3), np.eye(3))
    with pytest.raises(ValueError, match=r"cov must have shape \(3, 3\), got \(3,\)"):
        weigh(X, X)


@documented
def replay(log, drive):
    """A class that this module does not import.

    Parameters
    ----------
    log : path.Log
    drive : Drive
    """
    return log, drive


def test_a_class_that_is_not_imported_is_known_by_its_name_and_module():
    way, seen = np.zeros((1, 3)), drives.Drive(np.zeros((1, 3)), np.zeros((0, 2)), 0.1)
    own = path.Log(*[way] * len(fields(path.Log)))
    assert replay(own, seen) == (own, seen)
    with pytest.raises(ValueError, match="log must be of type path.Log, got an object of type Log"):
        replay(log.Log(way, way, way), seen)
    with pytest.raises(ValueError, match="drive must be of type Drive, got an object of type Log"):
        replay(own, own)
