"""The cell behind the sample files: its readings close the loop, with the noise that is said."""

import numpy as np

from labkit.geometry.frames import invert, pose
from labkit.geometry.lie import exp_so3, log_so3
from labkit.machines.sensor_cell import CELL


def test_poses_that_look_see_what_they_should():
    tilt, place = np.array([[0.1, -0.2, 0.3], [0.0, 0.0, 0.0]]), np.array([[10.0, -5.0, 450.0], [0.0, 0.0, 500.0]])
    T_BF = CELL.looking(tilt, place)
    seen = CELL.read(T_BF, None, std=0.0)
    assert np.allclose(seen, pose(exp_so3(tilt), place))
    moved = CELL.T_FS @ pose(exp_so3([0.0, 0.01, 0.0]), [0.0, 1.0, 0.0])
    assert np.allclose(T_BF @ moved @ CELL.read(T_BF, None, moved, std=0.0), CELL.T_BT)


def test_readings_carry_the_noise_that_is_said():
    """4000 readings: a standard deviation is known to 0.65 %, five of those are 3.3 %; fixed seed."""
    T_BF = np.repeat(CELL.looking([[0.1, 0.2, 0.3]], [[0.0, 0.0, 500.0]]), 4000, axis=0)
    exact, seen = CELL.read(T_BF, None, std=0.0), CELL.read(T_BF, np.random.default_rng(1))
    turn = log_so3((invert(exact) @ seen)[:, :3, :3])
    assert np.allclose(turn.std(0), CELL.std_rot, rtol=0.06)
    assert np.allclose((seen - exact)[:, :3, 3].std(0), CELL.std_trans, rtol=0.06)
