"""One bad entry among good ones is refused, by itself: what is asked of a batch is asked of each of its parts."""

import numpy as np
import pytest

from labkit.calibration import pivot, sphere
from labkit.estimation import clocks, gaussian, optimization
from labkit.geometry import chaining, frames
from labkit.localization import ekf, lateration, odometry, particles, sensors, wheels
from labkit.machines import arm, stations, tracking, triangulation

X, Y, ZERO = [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]
TRIANGLE, LINE, PLACE = [ZERO, X, Y], [ZERO, X, [2.0, 0.0, 0.0]], [ZERO, ZERO, ZERO]
STUCK = [0.0, 0.1, 0.1, 0.3]  # s: one of three steps does not advance
POSES = np.tile(np.eye(4), (4, 1, 1))
HALF_SEEN = [[[1.0, np.nan], [2.0, 0.1]]]  # one landmark of two without its bearing


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: frames.unit_vector([X, ZERO]), "zero vector"),
        (lambda: frames.gram_schmidt([X, ZERO], [Y, Y]), "a is zero"),
        (lambda: frames.gram_schmidt([X, X], [Y, ZERO]), "b is zero"),
        (lambda: frames.gram_schmidt([X, X], [Y, X]), "parallel"),
        (lambda: frames.frame_from_points([ZERO, ZERO], [X, X], [Y, ZERO]), "y_point"),
        (lambda: frames.matrix_from_quaternion([[0, 0, 0, 1.0], [0, 0, 0, 0]]), "zero"),
        (lambda: frames.fit_frame([TRIANGLE, PLACE], [TRIANGLE, TRIANGLE]), "coincide"),
        (lambda: frames.fit_frame([TRIANGLE, LINE], [TRIANGLE, TRIANGLE]), "collinear"),
        (lambda: chaining.orthonormalize([np.eye(4), np.diag([1.0, 1.0, -1.0, 1.0])]), "right-handed"),
        (lambda: optimization.newton_parts([1.0, 1.0], np.diag([1.0, 0.0])), "singular"),
        (lambda: gaussian.chi_square_quantile([0.5, 1.5], 2), "between 0 and 1"),
        (lambda: gaussian.chi_square_quantile(0.5, [2, 0]), "dof"),
        (lambda: clocks.sample_stream(STUCK, POSES, [0.05]), "does not after sample 1"),
        (lambda: arm.joint_speeds(STUCK, np.zeros((4, 6))), "increase"),
        (lambda: tracking.speeds(STUCK, POSES), "does not after sample 1"),
        (lambda: sphere.center_offset([30.0, 30.0], [20.0, 31.0]), "larger than the sphere"),
        (lambda: sphere.fit_circle([[0, 1, 2, 3], [0, 1, 2, 3]], [[0, 1, 1, 0], [0, 0, 0, 0]]), "collinear"),
        (lambda: pivot.tilted([X, ZERO], [0.0, 0.0]), "must not be zero"),
        (lambda: stations.station_angles(np.eye(4), [[0, 0, 1.0], [0, 0, -1.0]]), "in front of"),
        (lambda: stations.ray_direction([[0.1, 0.1], [0.1, 1.6]]), "between -90 and 90"),
        (lambda: triangulation.height_from_angles([0.5, -0.5], 1.0, 100.0), "alpha must be positive"),
        (lambda: triangulation.height_from_angles([0.5, 2.5], 1.0, 100.0), "below 180"),
        (lambda: wheels.ackermann_to_twist([[1.0, 0.1], [1.0, 1.6]], 0.3), "right angle"),
        (lambda: sensors.as_beam_model(0.2, 4.0, (0.9, 0.2, -0.1, 0.0), 0.5), "from 0 to 1"),
        (lambda: odometry.turning_center(np.zeros((2, 3)), [[1.0, 0.2], [1.0, 0.0]]), "omega must not be zero"),
        (lambda: lateration.dilution([[0, 0], [4, 0], [0, 4.0]], [[1, 1], [4, 0.0]]), "coincides"),
        (lambda: lateration.dilution([[0, 0], [4, 0.0]], [[1, 1], [2, 0.0]]), "one line"),
        (lambda: particles.normalize_weights([0.0, np.inf]), "NaN in it|-inf"),
        (lambda: particles.normalize_weights([0.0, np.nan]), "NaN in it"),
        (lambda: ekf.measurement_jacobian([1.0, 2.0, 0.0], [[0.0, 0.0], [1.0, 2.0]]), "stands on"),
        (
            lambda: ekf.ekf_localize(
                [[1.0, 0.1]], HALF_SEEN, [[1.0, 0.0], [2.0, 0.0]], [0, 0, 0], np.eye(3), 0.1, 0.1, 0.1
            ),
            "NaN in both",
        ),
    ],
)
def test_it_is_refused(call, words):
    with pytest.raises(ValueError, match=words):
        call()


def test_one_flat_direction_makes_a_place_degenerate():
    assert optimization.classify_extremum([0.0, 0.0], np.diag([1.0, 0.0])) == "degenerate"
