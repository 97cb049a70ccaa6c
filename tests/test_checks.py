"""Bad input to any module of the mathematics meets one sentence that says what was expected, what came, and where."""

import functools
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

from labkit import checks
from labkit.calibration import advice, ax_xb, hand_eye, motion, own_data, pivot, planning, robust, sphere
from labkit.calibration.literature import compare_methods, kim_linear, li_two_step
from labkit.documents.lecture import printed as lecture
from labkit.documents.lecture.examples import reconstruct_vehicle
from labkit.documents.thesis import printed as thesis
from labkit.documents.thesis import wells
from labkit.documents.thesis.listings import listing_cost
from labkit.estimation import gaussian, influence, kalman, optimization
from labkit.estimation.differences import numeric_jacobian
from labkit.fast import sensors as fast_sensors
from labkit.fast.ekf import ekf_localize
from labkit.fast.kalman import filter_steps
from labkit.fast.maps import RangeTable
from labkit.geometry import chaining, frames, lie, planar, propagation
from labkit.localization import drives, ekf, lateration, maps, mcl, odometry, particles
from labkit.localization.drives import find_route, follow
from labkit.localization.ekf import unscented_predict, unscented_update
from labkit.localization.locate import locate, place_readings
from labkit.localization.sensors import LikelihoodField, Scanner, beam_density, see_landmarks, weigh_doors
from labkit.machines import cell, robot_accuracy, simulation, stations, triangulation, udp
from labkit.machines.arm import (
    HOME,
    TX40,
    dh_matrix,
    inverse_kinematics,
    joint_speeds,
    measuring_poses,
    pose_error,
    reach_position,
    rotation_only,
    smooth_motion,
    tool_pose,
)
from labkit.machines.log import mean_pose, reject_outliers
from labkit.machines.mounting import e_rot, e_trans
from labkit.machines.packet import encode_packet, packet_from_pose
from labkit.machines.tracking import filter_positions, shift_time, speeds, summarize, time_offset, tracking_errors
from labkit.machines.triangulation import place_from_angles

I2, I3, I4, O2, O3 = np.eye(2), np.eye(3), np.eye(4), np.zeros(2), np.zeros(3)
ON_X = np.array([[1.0, 0.0], [2.0, 0.0]])
POSES = np.tile(I4, (5, 1, 1))
HOME, ARM = HOME, TX40
GRID = maps.OccupancyGrid.from_ascii("###\n#.#\n###")
COV = np.diag([0.1, 0.1, 0.01])
MARKS = np.array([[0.0, 0.0], [5.0, 1.0], [2.0, 6.0]])
SIGHTINGS = [I4] * 4, np.zeros((4, 3))
TIME = np.arange(5.0)
STEP = kalman.update(O2, np.eye(2), O2, np.eye(2), np.eye(2))


def rng():
    return np.random.default_rng(0)


REFUSED = [
    # the checks themselves
    (lambda: checks.as_number([1.0, 2.0], "x"), r"x must have shape \(\), got \(2,\)"),
    (lambda: checks.as_shape(O3, "x", "n", 3), r"x must have shape \(n, 3\), got \(3,\)"),
    (lambda: checks.as_shape(O3, "x", 2), r"x must have shape \(2,\), got \(3,\)"),
    (lambda: checks.as_count(2.5, "n"), "n must be a whole number, at least 1, got 2.5"),
    (lambda: checks.as_count("many", "n"), "n must hold real numbers, got text"),
    (lambda: checks.as_floats(np.array([1j]), "x"), "x must hold real numbers, got complex numbers"),
    (lambda: checks.as_floats(np.array(["1"]), "x"), "x must hold real numbers, got text"),
    (lambda: checks.as_floats(b"1", "x"), "x must hold real numbers, got bytes"),
    (lambda: checks.as_floats([True, False], "x"), "x must hold real numbers, got truth values"),
    (lambda: checks.as_floats(np.array(["2016-05-04"], "M8[D]"), "x"), "x must hold real numbers, got dates"),
    (lambda: checks.as_floats(np.array([3], "m8[s]"), "x"), "x must hold real numbers, got durations"),
    (lambda: checks.as_floats(None, "x"), "x must hold real numbers, got None"),
    (lambda: checks.as_floats([1.0, None], "x"), "x must hold real numbers, got None"),
    (lambda: checks.as_floats(np.array(["1", 2.0], object), "x"), "got an entry of type str"),
    (lambda: checks.as_floats({}, "x"), "got an entry of type dict"),
    (lambda: checks.as_floats([[1.0, 2.0], [3.0]], "x"), "got rows of different lengths"),
    (lambda: checks.as_floats([10**400], "x"), "x must hold numbers below 1e308"),
    (lambda: checks.as_floats(np.zeros(2, [("a", float)]), "x"), "got entries of type"),
    (lambda: checks.as_points([0.0, 1e200], "x", 2), r"x must hold numbers below 1e\+75, got 1e\+200"),
    (lambda: checks.as_finite([0.0, -1e76], "x"), r"x must hold numbers below 1e\+75, got 1e\+76"),
    (lambda: checks.as_finite(np.full(1000, 1e76), "x"), r"x must hold numbers below 1e\+75, got 1e\+76"),
    (lambda: checks.as_number(1e200, "x"), r"x must hold numbers below 1e\+75"),
    (lambda: checks.as_positive([1.0, 1e-76], "std"), "std must be at least 1e-75, got 1e-76"),
    (lambda: checks.as_positive([1.0, 0.0], "std"), "std must be positive, got 0"),
    (lambda: checks.as_size(1e7 + 1, "n"), r"n must be at most 1e\+07, got 10000001"),
    (lambda: checks.as_indices([1e18], "rows"), r"rows must hold whole numbers, of amounts up to 1e\+15"),
    (lambda: checks.as_probability(1e-320, "p"), "p must lie between 0 and 1, got 9.99"),
    (lambda: checks.as_transforms(np.diag([1, 1, 1, 1 + 1e-5]), "T"), r"got \(0, 0, 0, 1.00001\)"),
    (lambda: checks.as_transforms(np.diag([1, 1, 1, -1]), "T"), r"got \(0, 0, 0, -1\)"),
    (lambda: checks.as_readings([np.inf], "z"), "z must be finite, or NaN"),
    (lambda: checks.as_covariances([[1.0, 0.5], [0.0, 1.0]], "cov", 2), "cov must be symmetric"),
    (lambda: checks.as_covariances([[1e6, 0.5], [0.0, 1e-8]], "cov", 2), "cov must be symmetric"),
    (lambda: checks.as_covariances([1e6 * I3, I3 + np.eye(3, k=1)], "cov", 3), "cov must be symmetric"),
    (lambda: checks.as_covariances([[1.0, 1.1], [1.1, 1.0]], "cov", 2), "cov must be positive definite or singular"),
    (lambda: checks.as_covariances([[0.0, 0.1], [0.1, 1.0]], "cov", 2), "cov must be positive definite or singular"),
    (lambda: checks.as_covariances([I3, 1.6 * I3 - 0.6], "cov", 3), "cov must be positive definite or singular"),
    (lambda: checks.as_covariances([[-1.0, 0.0], [0.0, 1.0]], "cov", 2), "no negative variance, got -1"),
    (lambda: checks.as_probability(1.0, "p"), "p must lie between 0 and 1"),
    (lambda: checks.fit_together(a=(2,), b=(3,)), r"got \(2,\) of a, \(3,\) of b"),
    # lie, frames, chaining, pivot
    (lambda: lie.skew([1.0, np.nan, 0.0]), "v must be finite"),
    (lambda: lie.exp_so3(O2), "phi must have shape"),
    (lambda: lie.log_so3(I4), "R must have shape"),
    (lambda: lie.exp_se3(O3), "xi must have shape"),
    (lambda: lie.log_se3(I3), "T must have shape"),
    (lambda: lie.nearest_rotation(O3), "M must have shape"),
    (lambda: frames.unit_vector(2.0), "single number"),
    (lambda: frames.frame_from_points(np.zeros((2, 3)), np.ones((3, 3)), O3), r"\(2,\) of origin, \(3,\) of x_point"),
    (lambda: frames.transform(POSES, np.zeros((4, 3))), r"\(5,\) of T, \(4,\) of points"),
    (lambda: frames.relative(POSES, POSES[:2]), "T_WB"),
    (lambda: frames.rotation_angle(np.eye(2)), r"T must have shape \(..., 4, 4\) or"),
    (lambda: frames.gram_schmidt_covariance(0.0, 1.0, 1.0, 0.1), "must not be 0"),
    (lambda: frames.gram_schmidt_covariance([1.0, 2.0], 1.0, 1.0, 0.1), "x_arm must have shape"),
    (lambda: frames.fit_covariance(np.outer(range(4), [1.0, 2.0, 3.0]), 0.1), "collinear"),
    (lambda: frames.fit_frame(np.ones((4, 3)), np.ones((4, 3))), "the points coincide"),
    (lambda: frames.fit_covariance(I3[:2], 0.1), "at least 3 points"),
    (lambda: chaining.chain(3.0), "must be a sequence of transforms"),
    (lambda: chaining.chain([POSES, POSES[:2]]), r"transforms\[1\]"),
    (lambda: chaining.around(POSES, [(7, True)]), "links from 0 to 4, got 7"),
    (lambda: chaining.around(POSES, []), "sequence of pairs"),
    (lambda: chaining.noisy_links(POSES, 0.1, 0.1, rng(), runs=0), "runs must be a whole number"),
    (lambda: chaining.solve_pose_graph([(0, 1.5)], POSES[:1], 0.1, 0.1), "pairs of two different nodes"),
    (lambda: chaining.solve_pose_graph([(1, 1)], POSES[:1], 0.1, 0.1), "pairs of two different nodes"),
    (lambda: chaining.orthonormality_error(O3), "T must have shape"),
    (lambda: pivot.calibrate_pivot(POSES, [0.1], 0.1), "std_rot must have shape"),
    (lambda: pivot.touching_poses(I3, O3, O3, 0.0, np.nan, rng()), "std_trans must be finite"),
    (lambda: pivot.touching_poses(I3, O3, O3, -0.1, 0.0, rng()), "std_rot must not be negative"),
    (lambda: pivot.tilted(np.ones((2, 3)), spin=[0.1, 0.2, 0.3]), "of spin"),
    (lambda: pivot.cone(5, 0.1, turns="once"), "turns must hold real numbers"),
    (lambda: pivot.predicted_covariance(POSES[:, :3, :3], O3, None, 0.1), "std_rot must hold real numbers"),
    # sphere, hand-eye
    (lambda: sphere.scan_line(O3, 30.0, np.nan, 5), "half_angle must be finite"),
    (lambda: sphere.scan_line(O3, 30.0, 1.0, 5, std=0.1), "rng must be given"),
    (lambda: sphere.scan_line(O3, 30.0, 1.0, 0), "n must be a whole number"),
    (
        lambda: sphere.profile_center_covariance(30.0, sphere.fit_circle([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]), 2),
        r"side must be \+1 or -1",
    ),
    (lambda: sphere.sphere_center_from_profile(O3, O3, 30.0, [1, 1]), r"side must be \+1 or -1"),
    (lambda: hand_eye.rms_distance(np.zeros((0, 3))), "N >= 1"),
    (lambda: listing_cost(np.zeros((0, 3))), "n >= 1"),
    (lambda: hand_eye.rate_matrix(np.nan, 0.0), "A must be finite"),
    (lambda: hand_eye.kuka_jacobian(np.zeros(6), POSES, np.ones((4, 3))), "T_BF and x_S must have shapes"),
    (lambda: hand_eye.joint_jacobian(POSES, np.ones((4, 3)), I4), "T_BF and x_S must have shapes"),
    (lambda: hand_eye.linear_start(POSES, np.ones((4, 3))), "T_BF and x_S must have shapes"),
    (lambda: hand_eye.leave_one_out(POSES, np.ones((4, 3))), "T_BF and x_S must have shapes"),
    (lambda: hand_eye.gauss_newton_pose(np.zeros(6), POSES, np.zeros((5, 3))), "away from the scanner's origin"),
    (lambda: numeric_jacobian(np.sin, O2, [1e-6, 1e-6, 1e-6]), "x and step must have shapes"),
    (lambda: robust.tukey_weights([1.0], 1.0, cut=np.nan), "cut must be finite"),
    (lambda: hand_eye.fit_radius(POSES, np.array([[1.0, 0.0, 1.0]] * 5)), "off the scan plane"),
    (lambda: kim_linear(POSES, np.zeros((5, 3, 3)), np.zeros((4, 3))), r"points_S must have shape \(5, 4, 3\)"),
    (lambda: li_two_step(POSES[:1], np.zeros((1, 3))), "at least 2 poses"),
    (lambda: planning.predicted_sphere_covariance(POSES, I4, O3 + 1.0, 0.1), "undetermined"),
    (lambda: compare_methods(0, 0.1, rng()), "repeats must be a whole number"),
    (lambda: planning.pattern(I4, O3, 0.1, [1.0, np.inf, 1.0]), "spread must be finite"),
    (lambda: thesis.centers_with_radius([[1.0, np.nan, 1.0]], 30.0), "x_S must be finite"),
    (lambda: thesis.centers_with_radius(I3, -1.0), "R must be positive"),
    (lambda: ax_xb.kronecker_matrix(POSES * np.nan, POSES), "A must be finite"),
    (lambda: ax_xb.kronecker_matrix(POSES, POSES[:2]), "as many motions"),
    (lambda: ax_xb.rotation_from_kronecker(I4), r"M must have shape \(m, 9\)"),
    (lambda: ax_xb.translation_from_motions(POSES, POSES, np.full((3, 3), np.nan)), "R must be finite"),
    (lambda: ax_xb.calibrate_hand_eye(POSES, POSES, std_rot=[0.1]), "std_rot must have shape"),
    # robot, tracker
    (lambda: dh_matrix(O2, O3, 0.0, 0.0), r"\(2,\) of theta, \(3,\) of d"),
    (lambda: pose_error(I3, I4), "T must have shape"),
    (lambda: inverse_kinematics(ARM, I4, HOME, tolerance=np.nan), "tolerance must be finite"),
    (lambda: inverse_kinematics(ARM, I4, np.tile(HOME, (2, 1))), "one for all or one per pose"),
    (lambda: measuring_poses(ARM, rng(), count=np.inf), "count must be finite"),
    (lambda: simulation.simulate_motion("slow", rng(), rate=2.5e5), "from 1 to 250000 steps, got 10 s at 250000"),
    (lambda: smooth_motion(np.tile(HOME, (2, 1)), 1e-9, 1.0), "from 1 to 250000 steps"),
    (lambda: rotation_only(ARM, I4, HOME, np.zeros((1, 3)), 0.1, 1.0, 10.0), "none may be zero"),
    (lambda: joint_speeds(np.zeros(3), np.zeros((3, 6))), "increase"),
    (lambda: reach_position(ARM, np.zeros((2, 3)), HOME), r"position must have shape \(3,\)"),
    (lambda: encode_packet(np.full(23, np.nan)), "values must be finite"),
    (lambda: packet_from_pose(I4, np.nan), "time must be finite"),
    (lambda: packet_from_pose(I4, [0.0, 1.0]), "one pose"),
    (lambda: frames.quaternion_from_matrix(2 * I3), "orthonormal"),
    (lambda: reject_outliers([1.0, 2.0, 3.0], factor=np.nan), "factor must be finite"),
    (lambda: mean_pose(POSES[:0]), "at least one pose"),
    (lambda: e_rot(np.zeros((9, 9))), "at least two motions"),
    (lambda: e_trans(np.zeros((1, 3))), "at least 2 residuals"),
    (lambda: speeds(np.zeros(5), POSES), "time must increase"),
    (lambda: tracking_errors(TIME, POSES, POSES, velocities=(O3, O3)), r"velocities must have shape \(2, 5\)"),
    (lambda: summarize([]), "at least one number"),
    (lambda: time_offset(TIME**2, TIME, TIME), "even steps"),
    (lambda: time_offset([], [], []), "at least 3 samples"),
    (lambda: shift_time(TIME[::-1], POSES, 0.1), "time must increase"),
    (lambda: shift_time(TIME, POSES, np.inf), "offset must be finite"),
    (lambda: filter_positions(TIME[:0], np.zeros((0, 3))), "at least one reading"),
    (lambda: filter_positions(-TIME, np.zeros((5, 3))), "time must increase"),
    (lambda: simulation.calibration_run(rng(), rate=0.1), "readings per stop"),
    (lambda: next(udp.stream([b""], 0.0, udp.Faults(), rng())), "rate must be positive"),
    # lateration, odometry, gaussian
    (lambda: lateration.laterate(MARKS, [1.0, 2.0, 3.0], O2, std=[0.1, 0.2]), "std must have shape"),
    (lambda: lateration.laterate(MARKS, np.ones((2, 3)), np.zeros((3, 2))), "of start"),
    (lambda: lateration.circle_intersections(np.zeros((2, 2)), [1.0, 1.0]), "do not meet in two points"),
    (lambda: lateration.square_jacobian(3.0, O2), "landmarks must have shape"),
    (lambda: planar.wrap_angle([0.0, np.nan]), "angle must be finite"),
    (lambda: odometry.step(np.zeros((2, 3)), np.zeros((3, 2)), 0.1), r"\(2,\) of x, \(3,\) of u"),
    (lambda: odometry.control_covariance(O2, 0.1, "much", 0.0, 0.0), "k_d must hold real numbers"),
    (lambda: odometry.propagate(O3, -COV, O2, 0.1, np.eye(2)), "cov must hold no negative variance"),
    (lambda: odometry.drive(np.zeros((2, 3)), np.zeros((4, 3, 2)), 0.1), "of controls"),
    (lambda: odometry.noisy_controls(np.zeros((4, 2)), 0.1, 0.1, 0.1, 0.1, rng(), 0), "runs must be a whole number"),
    (lambda: lecture.circle_drive(1e9), "dt must lie between"),
    (lambda: gaussian.ellipse(O2, np.eye(2), probability=np.nan), "probability must be finite"),
    (lambda: gaussian.ellipse(O2, -np.eye(2)), "no negative variance"),
    (lambda: gaussian.ellipse(O2, I3), "cov must have shape"),
    (lambda: gaussian.share_inside(np.zeros((0, 2)), O2, np.eye(2)), "at least one"),
    (lambda: gaussian.share_inside(np.zeros((4, 2)), O2, np.zeros((2, 2))), "positive definite"),
    (lambda: gaussian.share_inside(np.zeros((4, 2)), O2, np.array([[1.0, 2.0], [2.0, 1.0]])), "positive definite"),
    (lambda: gaussian.share_inside(np.zeros((4, 2)), O2, np.array([[1.0, 0.5], [0.0, 1.0]])), "symmetric"),
    # kalman
    (lambda: kalman.predict(1.0, [[1.0]], [[1.0]]), "single number"),
    (lambda: kalman.predict(O2, np.eye(2), np.eye(2), [1.0, 0.0]), "B must have shape"),
    (lambda: kalman.update(O2, np.zeros((2, 2)), [0.0], [[1.0, 0.0]], [[0.0]]), "must be positive definite"),
    (lambda: kalman.update(O2, np.eye(2), [0.0], [[1.0, 0.0]], [[-1.0]]), "cov_z must hold no negative variance"),
    (lambda: kalman.filter_steps([[np.inf]], [[1.0]], [[1.0]], [[1.0]], [0.0], [[1.0]]), "NaN where nothing"),
    (
        lambda: filter_steps([[1.0]], np.eye(2), [[1.0, 0.0]], [[1.0]], O3, np.eye(2)),
        r"C must have shape \(..., m, 3\)",
    ),
    (lambda: kalman.steady_state(np.eye(2), [[1.0]], np.eye(2), [[1.0]]), r"C must have shape \(1, 2\)"),
    (lambda: lecture.example("soccer"), "name must be"),
    (lambda: reconstruct_vehicle(np.eye(2), 1, 0.1), "steps must be a whole number, at least 2"),
    (lambda: kalman.nees(O3, O3, np.zeros((3, 3))), "cov must be positive definite"),
    (lambda: kalman.nees(O3, O3, COV, angle=5), "index of one of 3 states"),
    (lambda: kalman.nis(O3, np.eye(2)), "cov_innovation must have shape"),
    (lambda: kalman.mean_band(3, 0), "runs must be a whole number"),
    (
        lambda: kalman.gate(STEP, probability=2.0),
        "probability must lie between",
    ),
    (lambda: ekf.ekf_update(O3, COV, np.full((3, 2), np.inf), MARKS + 1, 0.1, 0.1), "NaN where nothing"),
    (lambda: ekf.ekf_update(O3, COV, np.ones((2, 2)), MARKS + 1, 0.1, 0.1), "one row per landmark"),
    (lambda: ekf.ekf_update(O3, COV, MARKS, MARKS + 1, 0.1, 0.1, iterations=0), "iterations must be a whole"),
    (lambda: ekf.unscented_update(O3, COV, MARKS, MARKS + 1, -0.1, 0.1), "std_range must be positive"),
    (lambda: ekf.unscented_update(O3, 0 * COV, MARKS, MARKS + 1, 0.1, 0.1), "positive definite"),
    (lambda: ekf.associate(O3, COV, MARKS, MARKS + 1, 0.1, np.nan), "std_bearing must be finite"),
    (lambda: ekf.associate(O3, COV, MARKS, np.zeros((0, 2)), 0.1, 0.1), "at least one"),
    (
        lambda: ekf.simulate_drive(O3, np.zeros((2, 2)), 0.1, np.eye(2), MARKS, np.nan, 0.1, rng(), 2),
        "std_range must be finite",
    ),
    (
        lambda: ekf_localize(np.zeros((2, 2)), np.zeros((2, 3, 2)), MARKS + 1, O3, np.tile(COV, (4, 1, 1)), 0.1, 1, 1),
        "cov0 must come once",
    ),
    # maps, particles
    (lambda: maps.OccupancyGrid.from_ascii(None), "art must be a text"),
    (lambda: maps.OccupancyGrid.from_lines([[0, 0, 1, 1]], 1e-9), "at most 1e\\+08 cells"),
    (lambda: maps.OccupancyGrid.from_lines([[0, 0, 1, 1]], 0.1, margin=-1.0), "margin must not be negative"),
    (lambda: maps.walk_ray(GRID, [1.5, 1.5, 0.0], np.nan, 5.0), "bearing must be finite"),
    (lambda: RangeTable(GRID, 5.0, 0), "n_angles must be a whole number"),
    (lambda: RangeTable(GRID, 5.0, 4).cast(O3, [0.0], r_max=np.nan), "r_max must be finite"),
    (lambda: LikelihoodField(GRID, 0.1, share_hit="most"), "share_hit must hold real numbers"),
    (lambda: Scanner().scan(GRID, O3, rng(), every=0), "every must be a whole number"),
    (lambda: particles.sample_motion(I3, [1.0, 0.0], 0.1, rng(), -np.eye(2)), "no negative variance"),
    (lambda: particles.sample_motion(I3, np.ones((3, 2)), 0.1, rng(), np.eye(2)), "u and cov_u must have shapes"),
    (lambda: fast_sensors.weigh_beams(GRID, [1.0], [0.0], 0.1, 5.0, step=1e-12), "a millionth of r_max"),
    (lambda: beam_density([np.nan], [1.0], 0.1, 5.0, (1, 0, 0, 0)), "ranges must be finite"),
    (lambda: beam_density([1.0], [1.0], 0.0, 5.0, (1, 0, 0, 0)), "std must be positive"),
    (lambda: beam_density([1.0], [1.0], 0.1, 5.0, (1, 1, 0, 0)), "add up to 1"),
    (lambda: weigh_doors([], True), "at least one position"),
    (lambda: particles.normalize_weights(["a"]), "log_weights must hold real numbers"),
    (lambda: particles.resample_systematic([5e-324, 5e-324], rng()), "from 1e-300 to 1e300"),
    (lambda: particles.resample_roulette([1e308, 1e308], rng()), "from 1e-300 to 1e300"),
    (lambda: particles.resample_systematic([1.0, 1.0], rng(), 1.5), "size must be a whole number"),
    (lambda: particles.should_resample([1.0], np.nan), "threshold must be finite"),
    (lambda: particles.estimate(I3, [1.0, 1.0]), "one weight per state"),
    (lambda: particles.estimate(np.zeros((0, 3))), "at least one state"),
    (lambda: particles.estimate_mode(I3, cell=np.inf), "cell must be finite"),
    (lambda: mcl.recover(np.nan, 1.0, 1.0), "w_mean must be finite"),
    (lambda: particles.kld_size(10, epsilon=0.0), "epsilon must be positive"),
    (lambda: particles.KldSampling(n_min=np.nan).enough(I3), "n_min must be finite"),
    (lambda: follow(O3, [[1.0, 1.0]], 5, 0.0), "dt must be positive"),
    (lambda: see_landmarks(None, O3, MARKS, rng(), std_range=-0.1), "std_range must not be negative"),
    (lambda: find_route(["x"], "a", "b"), "edges must be pairs"),
    (lambda: find_route([("a", ["b"])], "a", "b"), "places must hold names, got an object of type list"),
    (
        lambda: locate([0.0], [[1.0, 0.0]], [0.0], [["a"]], [[1.0, 0.0]], ["a"], [[2.0, 0.0]]),
        "ids must hold names, got an object of type list",
    ),
    (
        lambda: locate([0.0], [[1.0, 0.0]], [0.0], [], [[1.0, 0.0]], ["a"], [[2.0, 0.0]]),
        "ids must hold 1 names, got 0",
    ),
    (lambda: particles.uniform_states(GRID, -1, rng()), "n_particles must be a whole number"),
    (lambda: mcl.localizer(GRID, np.add, -2000.0, rng(), start=O3), "n_particles must be a whole number, at least 1"),
    (lambda: tool_pose(TX40, np.zeros((3, 6)), np.tile(I4, (2, 1, 1))), r"\(3,\) of q, \(2,\) of T_FE"),
    (lambda: kalman.predict(O2, I2, I2, np.ones((2, 2, 1)), np.ones((3, 1))), r"\(2,\) of B, \(3,\) of u"),
    (
        lambda: kalman.predict(O2, I2, I2, cov_v=np.ones((3, 1, 1)) * I2, B=np.ones((2, 2, 1)), cov_u=[[1.0]]),
        "of cov_v",
    ),
    (lambda: cell.moved_part(POSES, POSES[:2], I4, I4), r"\(5,\) of T_BW, \(2,\) of T_WE0"),
    (lambda: stations.tilted(POSES, np.zeros((2, 3))), r"\(5,\) of T_WL, \(2,\) of rotation_and_shift"),
    (lambda: odometry.control_covariance(np.ones((3, 2)), np.ones(2), 0.1, 0.1, 0.1), r"\(3,\) of u, \(2,\) of dt"),
    (
        lambda: odometry.noisy_controls(np.ones((3, 2)), 1.0, 0, 0, 0, rng(), 10**7),
        "number of controls of all runs must",
    ),
    (lambda: ekf.associate(O3, np.tile(I3, (4, 1, 1)), ON_X, ON_X, 0.1, 0.1), r"cov must have shape \(3, 3\)"),
    (lambda: planning.unseen_changes(np.zeros((0, 4, 4)), I4, O3), "number of poses must be"),
    (lambda: reach_position(TX40, O3, np.zeros(6), iterations=10**12), r"iterations must be at most 1e\+07"),
    (lambda: triangulation.height_derivatives(1e-200, 1.4, 100.0), "squared sine of an angle must be"),
    (lambda: ekf.ekf_update(O3, 1e40 * I3, ON_X, ON_X, 0.1, 0.1), "the innovation must be positive definite"),
    (lambda: robot_accuracy.path_accuracy(np.zeros((4, 2)), np.zeros((0, 4, 2))), "number of paths must be a whole"),
    (lambda: GRID.at(O2, outside=()), r"outside must have shape \(\), got \(0,\)"),
    (lambda: checks.as_indices([0, 19], "index", below=19), "index must lie from 0 to 18, got 0 to 19"),
    (lambda: checks.as_indices([-1], "index", below=19), "index must lie from 0 to 18, got -1 to -1"),
    (lambda: checks.as_names([("a", [])], "ids"), "ids must hold names, got an object of type tuple"),
    (lambda: checks.as_row_weights([0.0, 0.0]), "weights must not all be zero"),
    (lambda: checks.as_truth(np.zeros(3), "wrap"), "wrap must be True or False, got an object of type ndarray"),
    (lambda: place_readings([5.0], [0], [1.0]), "odometry_time must hold at least 2 times, got 1"),
    (lambda: locate(*[[0.0]] * 7, truth={"a": 1.0}), "truth must hold times and poses, got 1 parts"),
    (lambda: locate(*[[0.0]] * 7, truth=([0.0], O3)), "the poses of truth must have shape"),
    (lambda: unscented_predict(np.zeros((5, 3)), I3, np.ones((4, 2)), 0.1, np.eye(2)), "leading axes must be equal"),
    (lambda: unscented_update(np.zeros((2, 3)), [I3] * 3, [[1, 0]], [[4, 4]], 0.1, 0.1), "leading axes must be equal"),
    # optimization, wells
    (lambda: optimization.newton_step([1.0, np.nan], np.eye(2)), "the gradient must be finite"),
    (lambda: optimization.newton_step(O2, I3), "the curvature must have shape"),
    (lambda: optimization.newton_step(O2, np.zeros((2, 2))), "the curvature H is singular"),
    (lambda: optimization.gauss_newton_step(O2, np.zeros((2, 3))), "m >= n"),
    (lambda: optimization.gauss_newton_step(O3, np.zeros((3, 2))), "the columns of J depend on each other"),
    (lambda: optimization.damped_step(O3, I3, -1.0), "damping must not be negative"),
    (lambda: optimization.cauchy_step(O2, np.eye(2), np.nan), "radius must be finite"),
    (lambda: optimization.dogleg_step(O2, np.eye(2), -1.0), "radius must not be negative"),
    (lambda: optimization.exact_step(O2, np.eye(2), "far"), "radius must hold real numbers"),
    (lambda: optimization.predicted_decrease(O2, np.eye(2), O3), "step must have shape"),
    (lambda: numeric_jacobian(np.sin, O2, step=0.0), "step must be positive"),
    (lambda: optimization.trust_region(wells.residual, wells.jacobian, O2, scale=O3 + 1), "one per unknown"),
    (lambda: optimization.trust_region(wells.residual, wells.jacobian, O2, accept="ok"), "accept must hold real"),
    (lambda: optimization.gauss_newton(wells.residual, wells.jacobian, O2, max_iterations=1.5), "max_iterations"),
    (
        lambda: optimization.gauss_newton(np.exp, lambda x: np.eye(2), O2, retract=lambda x, step: np.ones(3)),
        r"retract must keep the shape of x, \(2,\), got \(3,\)",
    ),
    (lambda: wells.which([np.nan, 0.0]), "x must be finite"),
    (
        lambda: optimization.gauss_newton(lambda x: O3 + 1, lambda x: I3, np.zeros(6)),
        r"x has shape \(6,\), but its derivatives are by 3 unknowns",
    ),
    # calibration, geometry, machines
    (lambda: advice.axis_name(np.array([True, False, False]), "flange"), "v must hold real numbers, got truth values"),
    (lambda: planning.predicted_sphere_covariance(np.zeros((0, 4, 4)), I4, O3, 0.1), "number of poses must be"),
    (lambda: simulation.stop_readings(np.zeros((0, 4, 4)), simulation.RESTING, rng()), "number of stops must be"),
    (lambda: robot_accuracy.path_repeatability(np.zeros((8, 0, 2))), "number of instants must be .* at least 1, got 0"),
    (
        lambda: simulation.calibration_run(rng(), joints=np.zeros((0, 6))),
        "number of stops must be .* at least 1, got 0",
    ),
    (lambda: gaussian.density(np.ones(7), np.ones(2), 1.0), r"got \(7,\) of x, \(2,\) of mean"),
    (lambda: chaining.expected_heights([[I4] * 2] * 3, 0.1, 0.1), r"transforms must have shape \(4, 4\)"),
    (lambda: propagation.product_jacobians([I4] * 3, [I4] * 2), "of T_AB, .* of T_BC"),
    (lambda: reach_position(TX40, O3, np.zeros(6), joints=[]), "joints must name at least one"),
    (lambda: reach_position(TX40, O3, np.zeros(6), joints=[6]), "joints must lie from 0 to 5, got 6 to 6"),
    (lambda: robot_accuracy.drive(np.zeros((3, 3)), 0.1, robot_accuracy.RobotErrors(offset=O2), rng()), "of offset"),
    (lambda: stations.poses_from_angles([I4], I3, np.zeros((0, 1, 3, 2)), np.zeros((0, 4, 4))), "at least one pose"),
    (lambda: place_from_angles(["a"], 1.0, 1.0), "alpha must hold real numbers, got text"),
    (lambda: advice.refuse_one_axis([I4], name=O3), "name must be of type str"),
    (lambda: sphere.sphere_center_from_profile(O3, O3, 30.0, [1.0, [2.0]]), r"side must be \+1 or -1"),
    (lambda: odometry.chord(np.ones(5), np.ones(2), 0.1, "arc"), r"must be equal or broadcast, got \(5,\) of v"),
    (lambda: pivot.pivot_residuals([I4], np.zeros((2, 3)), O3), r"tip must have shape \(3,\), got \(2, 3\)"),
    (lambda: pivot.as_poses([I4], np.datetime64("now")), "at_least must hold real numbers, got dates"),
    (lambda: pivot.refuse_free_tip(I4[None], 1e-6), "T must hold at least 2 poses, got 1"),
    (lambda: motion.turning(I3[None], np.zeros(1)), "weights must not all be zero"),
    (lambda: compare_methods(1, 0.1, rng(), {"truth": lambda scene: scene.target}), "what truth returns must have"),
    (lambda: hand_eye.leave_one_out(*SIGHTINGS, groups=["a", "b"]), "one group a pose, 4 of them, got 2"),
    (lambda: hand_eye.leave_one_out(*SIGHTINGS, groups=[1.0, [2.0], 3, 4]), "groups must hold names"),
    (lambda: own_data.FrameModel(np.eye(3), np.eye(3)).size(O3), r"channel must have shape \(\), got \(3,\)"),
    (lambda: own_data.FrameModel(np.eye(3), np.eye(3)).size(1), "channel must lie from 0 to 0, got 1 to 1"),
    (lambda: own_data.FrameModel(np.eye(3), np.eye(3)).noise(np.eye(3), np.zeros((3, 2, 6)), [True] * 3), "J must"),
    (lambda: own_data.FrameModel(I3, I3).noise(I3, np.zeros((3, 3, 0)), [True] * 3), "number of parameters in J must"),
    (
        lambda: planning.poses_that_see(I4, np.ones((2, 3)), np.tile(I3, (5, 1, 1)), np.ones((5, 3))),
        r"\(2,\) of target",
    ),
    (
        lambda: pivot.predicted_covariance(POSES[:, :3, :3], [1.2e31, -8e30, 1.5e32], 1e-3, 0.2),
        "noise of a reading must be pos",
    ),
    (lambda: ax_xb.noise_levels(1.0, 1.0, O2 + 1, (None, O2), 1.0), r"given must have shape \(\)"),
    (lambda: maps.OccupancyGrid.from_png(__file__, 1.0), "path must name a picture, and .* is none"),
    (lambda: GRID.at(O2, outside=10**30), "outside must hold whole numbers"),
    (lambda: hand_eye.calibrate_sphere_target(POSES, 1e-300 * np.eye(5, 3)), "the sphere stays at one place"),
    (lambda: propagation.point_jacobians([I4] * 3, np.ones((2, 3))), "leading axes must be equal or broadcast"),
    (lambda: influence.inverse_normal(np.zeros((3, 1, 0))), "J must hold numbers"),
    (lambda: drives.Wanderer(None, rng()).control(O3, 0.0), "dt must be positive"),
    (lambda: wells.value(O2, width=0.0), "width must be positive"),
]


@pytest.mark.parametrize("call, text", REFUSED)
def test_bad_input_is_refused_in_words(call, text):
    with pytest.raises(ValueError, match=text) as refusal:
        call()
    assert not isinstance(refusal.value, np.linalg.LinAlgError)


@pytest.mark.parametrize(
    "value, form, text",
    [
        (-1e-9, ".3f", "0.000"),
        (-0.0, "g", "0"),
        (-0.04, ".1f", "0.0"),
        (-0.06, ".1f", "-0.1"),
        (-1e-9, ".3g", "-1e-09"),
        ((0.6, -1e-17, -0.8), ".3f", "(0.600, 0.000, -0.800)"),
        (np.array([[-0.0, 1.0], [2.0, -3.0]]), "g", "((0, 1), (2, -3))"),
    ],
)
def test_what_rounds_to_zero_is_shown_without_a_sign(value, form, text):
    assert checks.shown(value, form) == text


def test_every_kind_of_real_number_is_a_float():
    kinds = ([1, 2], np.array([1, 2], np.int8), np.array([1, 2], np.float16), np.array([1, 2], np.longdouble))
    for value in (*kinds, [Fraction(1), Decimal(2)], np.array([1, 2.0], object), np.array([1.0, 2.0], ">f8")):
        array = checks.as_floats(value, "x")
        assert array.dtype == np.float64 and array.tolist() == [1.0, 2.0]
    kept = np.zeros(3)
    assert checks.as_floats(kept, "x") is kept


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_pose_that_is_off_by_rounding_is_a_pose(dtype):
    """A long product of poses and the general inverse leave a few last bits in the last row and in R'R."""
    T = lie.exp_se3(np.random.default_rng(3).normal(size=(50, 6)) * (1, 1, 1, 500, 500, 500)).astype(dtype)
    product = np.linalg.inv(np.linalg.multi_dot(list(T)))
    product[3, 3] += 2 * np.finfo(dtype).eps
    back = frames.invert(product)
    np.testing.assert_array_equal(back[3], (0.0, 0.0, 0.0, 1.0))
    scale = np.abs(product[:3, 3]).max()
    np.testing.assert_allclose((back @ product)[:3], np.eye(4)[:3], atol=1e3 * np.finfo(dtype).eps * scale)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_covariance_that_is_off_by_rounding_is_a_covariance(dtype):
    """Sums and products leave a singular covariance with last bits of asymmetry, and slightly negative eigenvalues."""
    J = np.random.default_rng(4).normal(size=(200, 6, 2)) * (1e-3, 1.0)
    J[..., :3, :] *= 1e-3  # three angles beside three lengths
    J[:50, 2], J[:20] = 0.0, 0.0
    noise = np.random.default_rng(5).uniform(-1, 1, (200, 6, 6)) * np.finfo(dtype).eps
    std = np.sqrt((J**2).sum(-1))
    cov = (J @ np.swapaxes(J, -1, -2) + noise * std[..., :, None] * std[..., None, :]).astype(dtype)
    assert np.linalg.eigvalsh(cov).min() < 0 and (cov != np.swapaxes(cov, -1, -2)).any()
    np.testing.assert_array_equal(checks.as_covariances(cov, "cov", 6), cov)


@pytest.mark.parametrize("spoil", [0.0, 4e-4, -6e-4, 2e-3, 1e-6, 2e-6, 1e74, 1e76, np.nan, np.inf, -np.inf])
def test_one_pose_and_a_row_of_poses_are_judged_alike(spoil):
    """One matrix, and few numbers, are seen to be sound on another way than a few, and a few on another than many."""
    good = frames.pose(lie.exp_so3([0.3, -0.7, 1.9]), [1.0, -2.0, 3.0])
    for place in np.ndindex(4, 4):
        T = good.copy()
        T[place] += spoil
        many = np.stack([good] * 150)
        many[77] = T
        for check, block in ((checks.as_transforms, slice(4)), (checks.as_rotations, slice(3))):
            values = (value[..., block, block] for value in (T, T[None], many))
            assert len({_is_refused(check, value) for value in values}) == 1, place
    mirrored = np.diag([1.0, 1.0, -1.0])
    for value in (mirrored, mirrored[None], np.stack([np.eye(3)] * 150 + [mirrored])):
        assert _is_refused(checks.as_rotations, value)


def _is_refused(check, value):
    try:
        assert check(value, "value") is value  # nothing is copied
    except ValueError:
        return True
    return False


def test_a_bound_beyond_all_numbers_still_refuses_infinity():
    for n in (1, 1000):
        assert not _is_refused(functools.partial(checks.as_finite, below=np.inf), np.full(n, 1e200))
        assert _is_refused(functools.partial(checks.as_finite, below=np.inf), np.full(n, np.inf))


def test_lists_are_as_good_as_arrays():
    g, H, r, J = [1.0, 2.0], [[3.0, 1.0], [1.0, 4.0]], [1.0, 2.0, 3.0], [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]
    for step in (optimization.cauchy_step, optimization.dogleg_step, optimization.exact_step):
        np.testing.assert_array_equal(step(g, H, 0.5), step(np.array(g), np.array(H), 0.5))
    np.testing.assert_allclose(np.array(H) @ optimization.newton_step(g, H), [-1.0, -2.0])
    np.testing.assert_allclose(np.transpose(J) @ (r + J @ optimization.gauss_newton_step(r, J)), 0.0, atol=1e-14)
    np.testing.assert_allclose(optimization.damped_step(r, J, 0.0), optimization.gauss_newton_step(r, J))


def test_the_effective_size_has_no_unit():
    weights = np.array([1.0, 2.0, 3.0])
    for unit in (1e-300, 1e-9, 1e9, 1e299):
        np.testing.assert_allclose(particles.effective_size(unit * weights), 36 / 14)
