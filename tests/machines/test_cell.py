"""The whole cell: its chain against the truth, its Jacobians against differences, its budget against Monte Carlo."""

import dataclasses
import functools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from labkit.geometry.frames import transform
from labkit.geometry.propagation import error_budget
from labkit.machines import cell as cells
from labkit.machines.arm import HOME, TX40, inverse_kinematics

CELL = cells.calibrated_cell(np.random.default_rng(1))
PLACES = (cells.LEARNED, (190.0, 100.0, 0.3), (60.0, 250.0, 1.5))
HOW = pytest.mark.parametrize("touched", [False, True])


def job(now=PLACES[2], touched=False):
    return cells.simulated_job(now, touched=touched)


@HOW
@pytest.mark.parametrize("now", PLACES)
def test_the_true_cell_finds_the_part_where_it_stands(now, touched):
    there = job(now, touched)
    np.testing.assert_allclose(cells.part_pose(cells.TRUTH, there), cells.place_on_table(*now), atol=1e-9)
    flange = cells.flange_at_hole(cells.TRUTH, there)
    hole = transform(cells.place_on_table(*now), cells.HOLE)
    np.testing.assert_allclose(transform(flange, cells.TRUTH.tip), hole, atol=1e-9)
    np.testing.assert_allclose(cells.miss(cells.TRUTH, cells.TRUTH, there), 0, atol=1e-9)


@HOW
def test_jacobians_are_those_of_central_differences(touched):
    there, h = job(touched=touched), 1e-5
    goal = cells.flange_at_hole(CELL, there)
    by_part, by_miss = cells.part_jacobians(CELL, there), cells.miss_jacobians(CELL, there)
    for name, cov in cells.source_covariances(CELL, there).items():
        columns = []
        for e in h * np.eye(len(cov)):
            ends = [cells.with_errors(CELL, there, {name: sign * e}) for sign in (1, -1)]
            part = [cells.part_pose(*end) for end in ends]
            turn = Rotation.from_matrix(part[1][:3, :3].T @ part[0][:3, :3]).as_rotvec()
            tip = [cells.flange_at_hole(*end)[:3, 3] - goal[:3, 3] for end in ends]
            columns.append(np.r_[turn, (part[0] - part[1])[:3, 3], tip[0] - tip[1]] / (2 * h))
        numeric = np.transpose(columns)
        np.testing.assert_allclose(by_part[name], numeric[:6], atol=2e-6, err_msg=name)
        np.testing.assert_allclose(by_miss[name], numeric[6:], atol=2e-6, err_msg=name)


@HOW
def test_the_budget_is_the_covariance_of_many_simulated_cells(touched):
    """4000 draws: each variance is known to 2.2 %, so none may be off by 12 %."""
    there = job(touched=touched)
    misses = cells.simulate_misses(CELL, there, np.random.default_rng(2), 4000)
    predicted = sum(cells.miss_budget(CELL, there).values())
    values, axes = np.linalg.eigh(predicted)
    np.testing.assert_allclose((misses @ axes).var(0), values, rtol=0.12)


@functools.cache
def calibrated_anew():
    return [cells.calibrated_cell(np.random.default_rng([7, seed])) for seed in range(50)]


@HOW
def test_the_budget_of_the_calibrations_is_that_of_measuring_them_anew(touched):
    """50 times all three calibrations from their raw readings; squared misses, in standard deviations: chi-square.

    Marks and readings are exact here; tests/bench/cell_budget.py does the same with thousands of cells and all noise.
    """
    there, total = job(touched=touched), 0.0
    for found in calibrated_anew():
        shares = cells.miss_budget(found, there)
        cov = sum(shares[name] for name in ("tip", "scanner", "tracker"))
        off = cells.miss(cells.TRUTH, found, there)
        total += off @ np.linalg.solve(cov, off)
    assert 1e-4 < chi2.cdf(total, 150) < 1 - 1e-4


def test_back_where_it_was_learned_the_tracker_cancels_and_touched_so_does_the_tip():
    home = {k: np.trace(v) for k, v in cells.miss_budget(CELL, job(cells.LEARNED)).items()}
    assert home["tracker"] < 1e-18 and home["tip"] > 1e-3 and home["scanner"] > 1e-3
    touched = {k: np.trace(v) for k, v in cells.miss_budget(CELL, job(cells.LEARNED, True)).items()}
    assert touched["tip"] < 1e-18 and touched["scanner"] == 0


def test_shifted_but_not_turned_only_the_tilt_of_the_world_matters():
    """Closed form: T_BW's shift cancels, its turn acts on the way the trolley has gone."""
    there = job((190.0, 100.0, 0.3))
    J = cells.miss_jacobians(cells.TRUTH, there)["tracker"]
    way = np.array([0.0, 280.0, 0.0])
    np.testing.assert_allclose(J[:, 3:], 0, atol=1e-9)
    np.testing.assert_allclose(J[:, :3], np.cross(cells.TRUTH.T_BW[:3, :3].T, way).T, atol=1e-6)  # (R e_k) x way


def test_a_calibration_that_is_wrong_moves_the_result_and_not_the_budget():
    there = job()
    bent, _ = cells.with_errors(CELL, there, {"tracker": np.r_[np.deg2rad([0, 0, 1.0]), 0, 0, 0]})
    moved = cells.hole_in_base(bent, there) - cells.hole_in_base(CELL, there)
    assert np.linalg.norm(moved) > 4
    before, after = (np.trace(sum(cells.miss_budget(c, there).values())) for c in (CELL, bent))
    assert after == pytest.approx(before, rel=0.05)


def test_correlations_within_a_calibration_matter():
    """The scanner's turn and shift come from one fit: at the marks they all but cancel, and their variances alone do
    not tell."""
    there = job()
    J, cov = cells.miss_jacobians(CELL, there)["scanner"], CELL.cov_FS
    whole, alone = (error_budget({"s": J}, {"s": c})["s"] for c in (cov, np.diag(np.diag(cov))))
    assert np.trace(alone) > 4 * np.trace(whole)


def test_frames_in_the_base_carry_their_covariance():
    there = job()
    frames = cells.frames_in_base(CELL, there)
    assert set(frames) == {"W", "E0", "E", "P0", "P", "F", "S"}
    np.testing.assert_allclose(transform(frames["F"][0], CELL.tip), cells.hole_in_base(CELL, there), atol=1e-9)
    np.testing.assert_allclose(frames["P"][1], cells.part_covariance(CELL, there))
    rng = np.random.default_rng(3)
    e = {n: rng.multivariate_normal(np.zeros(len(c)), c, 4000, method="svd") for n, c in
         cells.source_covariances(CELL, there).items()}  # fmt: skip
    drawn, drawn_job = cells.with_errors(CELL, there, e)
    found = {
        "P0": cells.learned_pose(drawn, drawn_job),
        "E0": drawn.T_BW @ drawn_job.T_WE0,
        "E": drawn.T_BW @ drawn_job.T_WE1,
    }
    for name, T in found.items():
        shifts = T[:, :3, 3].std(0)
        np.testing.assert_allclose(shifts, np.sqrt(np.diag(frames[name][1])[3:]), rtol=0.06)


@HOW
@pytest.mark.parametrize("now", PLACES)
def test_the_robot_reaches_all_of_it(now, touched):
    there = job(now, touched)
    goals = np.concatenate([there.T_BF, cells.flange_at_hole(cells.TRUTH, there)[None]])
    reached = np.zeros(len(goals), bool)
    for turn in (0.0, 2.0, -2.0, 1.0):
        start = np.clip(HOME + [turn, 0, 0, 0, 0, 0], TX40.q_min, TX40.q_max)
        reached |= inverse_kinematics(TX40, goals, start)[1]
        reached |= inverse_kinematics(TX40, goals, HOME + [0, 0, 0, 0, 0, turn])[1]
    assert reached.all()


def test_an_error_of_a_source_that_there_is_not_is_refused():
    with pytest.raises(ValueError, match="errors must be one of .*tip.* got 'other'"):
        cells.with_errors(CELL, job(), {"other": np.zeros(3)})


def test_marks_and_readings_have_the_noise_that_is_stated():
    there = dataclasses.replace(job(), std_mark=0.7, std_reading=(2e-3, 0.4))
    found = cells.source_covariances(CELL, there)
    marks = [cov for name, cov in found.items() if cov.shape == (9, 9)]
    np.testing.assert_allclose(marks, [0.49 * np.eye(9)])
    for cov in list(found.values())[-2:]:
        np.testing.assert_allclose(cov, np.diag([4e-6] * 3 + [0.16] * 3))


def test_the_scanner_is_calibrated_with_centers_of_the_stated_noise():
    """3 x 300 numbers less nine unknowns tell it to 2.4 %."""
    found = cells.calibrate_scanner(np.random.default_rng(3), n=300)
    assert np.sqrt((found.residuals**2).sum() / (3 * 300 - 9)) == pytest.approx(cells.STD_CENTER, rel=0.12)
