"""The one convention for results: names, blocks, lazy figures, and how a result prints itself."""

import dataclasses

import numpy as np
import pytest

from labkit.calibration import pivot
from labkit.calibration.result import Parameter, Result, pose_parameters, result_class
from labkit.geometry.frames import pose
from labkit.geometry.lie import exp_so3


@result_class
class Example(Result):
    T_FS: np.ndarray
    radius: float
    covariance: np.ndarray
    weights: np.ndarray
    singular_values: np.ndarray

    parameters = (*pose_parameters("T_FS"), Parameter("radius", "mm"))


@pytest.fixture
def pivoted():
    rng = np.random.default_rng(0)
    R = exp_so3(0.5 * rng.normal(size=(8, 3)))
    return pivot.calibrate_pivot(pivot.touching_poses(R, [1.0, 2.0, 100.0], [5.0, 6.0, 7.0], 1e-3, 0.2, rng))


def test_names_pick_blocks(pivoted):
    C = pivoted.covariance
    np.testing.assert_array_equal(pivoted.covariance_of("tip"), C[:3, :3])
    np.testing.assert_array_equal(pivoted.covariance_of("pivot"), C[3:, 3:])
    np.testing.assert_array_equal(pivoted.covariance_of("pivot", "tip"), C[3:, :3])
    np.testing.assert_array_equal(pivoted.covariance_of("tip.y", "pivot.z"), C[1:2, 5:])
    np.testing.assert_allclose(pivoted.std_of("pivot"), np.sqrt(np.diag(C)[3:]))
    assert pivoted.std_of("tip.z") == pytest.approx(np.sqrt(C[2, 2])) and isinstance(pivoted.std_of("tip.z"), float)


@pytest.mark.parametrize("name", ["ti", "tip.", "tip.w", "", "flange"])
def test_an_unknown_name_is_refused_with_the_known_ones(pivoted, name):
    with pytest.raises(ValueError, match=r"one of tip\.x, tip\.y, .*pivot\.z.*got"):
        pivoted.std_of(name)


def test_results_compare_by_identity_and_can_be_replaced(pivoted):
    assert pivoted == pivoted and hash(pivoted) == hash(pivoted)
    before = pivoted.residuals
    moved = dataclasses.replace(pivoted, pivot=pivoted.pivot + [0.0, 0.0, 1.0])
    assert moved != pivoted
    np.testing.assert_allclose(moved.residuals, before - [0.0, 0.0, 1.0], atol=1e-12)
    with pytest.raises(dataclasses.FrozenInstanceError):
        pivoted.tip = np.zeros(3)


def test_what_is_expensive_is_worked_out_once(pivoted):
    assert pivoted.covariance is pivoted.covariance and pivoted.residuals is pivoted.residuals


def test_a_result_prints_estimate_deviation_and_unit():
    T = pose(exp_so3(np.deg2rad([10.0, -20.0, 30.0])), [1.0, -2.0, 3.0])
    std = np.array([*np.deg2rad([0.1, 0.2, 0.4]), 0.05, 0.5, 5.0, 0.001])
    example = Example(T, 30.01234, np.diag(std**2), np.array([1.0, 0.0, 0.5]), np.array([9.0, 0.25]))
    lines = repr(example).splitlines()
    assert lines == [
        "Example",
        "  T_FS.rotation  10.00, -20.00, 30.00 deg  +- 0.10, 0.20, 0.40",
        "  T_FS.translation  1.000, -2.000, 3.000 mm  +- 0.050, 0.500, 5.000",
        "  radius  30.0123 mm  +- 0.0010",
        "  3 measurements, 1 of them without weight; singular values 9 to 0.25",
    ]
    page = example._repr_html_()
    assert "<td>T_FS.rotation</td><td>10.00, -20.00, 30.00</td><td>0.10, 0.20, 0.40</td><td>deg</td>" in page
    unsure = dataclasses.replace(example, covariance=np.full((7, 7), np.nan))
    assert "radius  30.012 mm  +- unknown" in repr(unsure)


def test_digits_are_unknown_when_one_deviation_is(pivoted):
    rows = dataclasses.replace(pivoted)._rows()
    assert all(spread != "unknown" for _, _, spread, _ in rows)
    for bad in (np.nan, np.inf, 0.0):
        spoilt = dataclasses.replace(pivoted)
        covariance = pivoted.covariance.copy()
        covariance[0, 0] = bad
        vars(spoilt)["covariance"] = covariance
        name, values, spread, _ = next(iter(spoilt._rows()))
        assert spread == "unknown" and values.count(".") == 3 and len(values.split(",")[0].split(".")[1]) == 3, name
