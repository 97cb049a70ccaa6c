"""What is called certainly rigid passes `as_transforms`, and nothing that it refuses is called so."""

import itertools

import numpy as np
import pytest

from labkit import checks
from labkit.fast.rigid import BLOCK, rigid_rows
from labkit.geometry.frames import pose
from labkit.geometry.lie import exp_so3


def stack(n, seed=0):
    rng = np.random.default_rng(seed)
    return pose(exp_so3(rng.uniform(-2, 2, (n, 3))), rng.uniform(-1000, 1000, (n, 3)))


@pytest.mark.parametrize("n", [1, 2, 100, BLOCK, BLOCK + 1])
def test_rows_are_a_copy_of_the_entries(n):
    T = stack(n)
    rows = rigid_rows(T, "T")
    assert rows.flags.c_contiguous and not np.shares_memory(rows, T)
    np.testing.assert_array_equal(rows.T.reshape(-1, 4, 4), checks.as_transforms(T, "T"))


def refused(T):
    with pytest.raises(ValueError):
        checks.as_transforms(T, "T")
    return True


@pytest.mark.parametrize("by", [np.nan, np.inf, -np.inf, 1e76, 0.002])
def test_one_spoiled_entry_anywhere_is_seen(by):
    good = stack(BLOCK + 5)
    for k, row, column in itertools.product((0, BLOCK - 1, BLOCK, BLOCK + 4), range(4), range(4)):
        T = good.copy()
        T[k, row, column] += by
        if column == 3 and row < 3 and by == 0.002:
            assert rigid_rows(T, "T") is not None  # a translation may be anything
        else:
            assert rigid_rows(T, "T") is None and (by == 0.002 or refused(T))


SPOILED = {
    "mirrored": np.diag([1.0, 1.0, -1.0, 1.0]),
    "mirrored twice over": np.diag([-1.0, -1.0, -1.0, 1.0]),
    "sheared": np.eye(4) + 0.002 * np.eye(4, k=1) * np.array([1, 1, 0, 0])[:, None],
    "in meters": np.diag([1e-3, 1e-3, 1e-3, 1.0]),
    "longer": np.diag([1.001, 1.001, 1.001, 1.0]),
    "scaled": 2.0 * np.eye(4),
}


@pytest.mark.parametrize("by", SPOILED.values(), ids=SPOILED)
def test_what_is_not_rigid_is_left_to_the_readable_check(by):
    T = stack(9)
    T[4] = T[4] @ by
    assert rigid_rows(T, "T") is None and refused(T)


def test_near_the_bounds_it_is_the_stricter_one():
    rng = np.random.default_rng(1)
    for size in 10.0 ** rng.uniform(-9, -2, 300):
        T = stack(3, seed=rng.integers(1 << 30))
        T[1, :, :3] += size * rng.normal(size=(4, 3)) * np.array([[1], [1], [1], [1e-3]])
        if rigid_rows(T, "T") is not None:
            checks.as_transforms(T, "T")  # which raises when it sees what the quick one did not


@pytest.mark.parametrize("value", [np.eye(4), np.zeros((0, 4, 4)), np.zeros((3, 3, 3)), stack(4).transpose(0, 2, 1)])
def test_no_stack_of_poses_has_no_rows(value):
    assert rigid_rows(value, "T") is None


def test_text_is_refused_by_name():
    with pytest.raises(ValueError, match="T_WF must hold real numbers, got text"):
        rigid_rows([["a"]], "T_WF")


def test_single_precision_is_left_to_the_readable_check_or_passes_both():
    T = stack(1000).astype(np.float32)
    assert checks.as_transforms(T, "T").dtype == np.float64
    rows = rigid_rows(T, "T")
    assert rows is None or np.array_equal(rows.T.reshape(-1, 4, 4), T)
