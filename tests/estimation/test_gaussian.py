"""Normal distributions: noise that repeats, covariances cut to fit a picture."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import kstest

from labkit.estimation import gaussian


def test_unit_noise_is_the_same_for_a_shape_and_a_seed():
    noise = gaussian.unit_noise((40, 3), seed=5)
    assert noise.shape == (40, 3) and gaussian.unit_noise((40, 3), seed=5) is noise
    np.testing.assert_array_equal(noise, np.random.default_rng(5).standard_normal((40, 3)))
    assert np.abs(gaussian.unit_noise((40, 3), seed=6) - noise).min() > 0
    assert kstest(gaussian.unit_noise((4000,), seed=5), "norm").pvalue > 1e-6


def test_nobody_can_write_into_unit_noise():
    with pytest.raises(ValueError, match="read-only"):
        gaussian.unit_noise((3,), seed=1)[0] = 0.0


def test_cut_axes_keeps_directions_and_short_axes():
    R = Rotation.from_rotvec([[0.3, -0.5, 0.4], [1.0, 2.0, -0.7]]).as_matrix()
    std = np.array([0.2, 0.9, 7.0])
    cut = gaussian.cut_axes((R * std**2) @ np.swapaxes(R, 1, 2), 1.5)
    np.testing.assert_allclose(cut, (R * [0.04, 0.81, 2.25]) @ np.swapaxes(R, 1, 2), atol=1e-12)


def test_cut_axes_refuses_a_limit_of_zero():
    with pytest.raises(ValueError, match="longest must be positive"):
        gaussian.cut_axes(np.eye(2), 0.0)
