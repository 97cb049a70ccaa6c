"""Base stations: sweeps, rays, places and poses, against closed forms, SciPy and Monte Carlo; stations that move."""

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from labkit.geometry.frames import invert, pose, pose_distance
from labkit.machines import simulation, stations
from labkit.machines.arm import TX40, tool_pose
from labkit.machines.mounting import calibrate_mounting

JOINTS = simulation.measuring_joints()
T_BF, T_BE = simulation.flange_poses(JOINTS), tool_pose(TX40, JOINTS, simulation.T_FE)


def test_straight_ahead_is_a_quarter_of_a_turn():
    """A station of the first generation counts 48 MHz: straight ahead is tick 200,000 of 400,000 a half turn."""
    assert stations.sweep_angle(200_000 / 48e6) == pytest.approx(0, abs=1e-12)
    assert stations.sweep_angle(400_000 / 48e6) == pytest.approx(np.pi / 2)
    angles = np.linspace(-1.5, 1.5, 7)
    np.testing.assert_allclose(stations.sweep_angle(stations.sweep_delay(angles, 50.0), 50.0), angles, atol=1e-12)
    with pytest.raises(ValueError, match="delay must be 0 to 0.00833333 s, half a turn, got 0.01"):
        stations.sweep_angle([0.001, 0.01])


def test_a_ray_lies_in_both_planes_of_light():
    alpha, beta = 0.7, -0.4
    d = stations.ray_direction([alpha, beta])
    vertical = np.cross([0, 1, 0], Rotation.from_euler("y", alpha).apply([0, 0, 1]))
    level = np.cross([1, 0, 0], Rotation.from_euler("x", -beta).apply([0, 0, 1]))
    np.testing.assert_allclose([d @ vertical, d @ level, d @ d], [0, 0, 1], atol=1e-12)
    point = np.array([300.0, -200.0, 900.0])
    seen = stations.station_angles(
        stations.STATIONS[0], stations.STATIONS[0][:3, :3] @ point + stations.STATIONS[0][:3, 3]
    )
    np.testing.assert_allclose(stations.ray_direction(seen), point / np.linalg.norm(point), atol=1e-12)


def test_the_plane_turns_from_minus_to_plus_x():
    """What is hit later lies farther along +x: the delay grows with the angle."""
    left, right = stations.station_angles(np.eye(4), [[-100.0, 0, 500], [100.0, 0, 500]])[:, 0]
    assert left < 0 < right and stations.sweep_delay(left) < stations.sweep_delay(right)


def test_two_rays_meet_halfway_between_their_nearest_points():
    o, d = np.array([[0.0, 0, 0], [10, 5, 3]]), np.array([[1.0, 0, 0], [0, 1, 0.0]])
    np.testing.assert_allclose(stations.nearest_to_rays(o, 7 * d), [10, 0, 1.5], atol=1e-12)


def test_the_nearest_point_to_many_rays_is_that_of_a_minimizer():
    rng = np.random.default_rng(1)
    o, d = rng.normal(size=(5, 3)) * 100, rng.normal(size=(5, 3))
    unit = d / np.linalg.norm(d, axis=1, keepdims=True)
    fit = least_squares(lambda p: np.cross(unit, p - o).ravel(), np.zeros(3))
    np.testing.assert_allclose(stations.nearest_to_rays(o, d), fit.x, atol=1e-5)


def test_parallel_rays_and_points_behind_are_refused():
    with pytest.raises(ValueError, match="not parallel"):
        stations.nearest_to_rays(np.eye(3), np.ones((3, 3)))
    with pytest.raises(ValueError, match="in front of the station"):
        stations.station_angles(np.eye(4), [0.0, 0.0, -5.0])
    with pytest.raises(ValueError, match="between -90 and 90 deg"):
        stations.ray_direction([2.0, 0.0])


def test_jacobian_of_the_angles_is_that_of_finite_differences():
    rng = np.random.default_rng(2)
    L, p, h = stations.STATIONS, rng.uniform(-300, 300, 3), 1e-3
    numeric = [
        (stations.station_angles(L, p + h * e) - stations.station_angles(L, p - h * e)) / (2 * h) for e in np.eye(3)
    ]
    np.testing.assert_allclose(stations.angle_jacobian(L, p), np.moveaxis(numeric, 0, -1), atol=1e-11)


def level(x, y):
    """A station at height 0 that looks along +y of W."""
    return stations.looking([x, y, 0.0], [x, y + 100.0, 0.0])


def test_a_station_looks_where_it_should():
    np.testing.assert_allclose(level(0, 0)[:3, :3], [[1, 0, 0], [0, 0, 1], [0, -1, 0]], atol=1e-15)
    at = np.array([250.0, 0.0, 450.0])
    np.testing.assert_allclose(stations.station_angles(stations.STATIONS, at), 0, atol=1e-12)
    np.testing.assert_allclose(stations.STATIONS[:, 2, 0], 0, atol=1e-15)


def test_places_on_the_line_of_both_stations_are_refused():
    with pytest.raises(ValueError, match="along one line"):
        stations.place_covariance([level(0, 0), level(0, -500)], [0, 900, 0], 1e-4)


@pytest.mark.parametrize("half_base, depth", [(1000.0, 2000.0), (200.0, 3000.0)])
def test_covariance_of_a_place_in_closed_form(half_base, depth):
    """Stations at (-b, 0) and (b, 0), the place at (0, d), r^2 = b^2 + d^2: var x = s^2 r^4 / (2 d^2), var y =
    s^2 r^4 / (2 b^2)."""
    L, s, r2 = np.array([level(-half_base, 0), level(half_base, 0)]), 1e-4, half_base**2 + depth**2
    cov = stations.place_covariance(L, [0, depth, 0], s)
    np.testing.assert_allclose(np.diagonal(cov)[:2], s**2 * r2**2 / 2 / np.array([depth, half_base]) ** 2)


def test_poses_come_back_from_angles_and_one_station_is_enough():
    angles = stations.body_angles(stations.STATIONS, stations.DIODES, T_BE)
    near = T_BE @ pose(Rotation.from_rotvec([0.1, -0.05, 0.1]).as_matrix(), [20.0, -10.0, 30.0])
    for n in (1, 2):
        found = stations.poses_from_angles(stations.STATIONS[:n], stations.DIODES, angles[:, :n], near)
        turn, off = pose_distance(found, T_BE)
        assert turn.max() < 1e-7 and off.max() < 1e-4
    with pytest.raises(ValueError, match="at least three diodes"):
        stations.poses_from_angles(stations.STATIONS, stations.DIODES[:2], angles[:, :, :2], T_BE)


def noisy_sight(n, std, rng, T=T_BE[3]):
    angles = stations.body_angles(stations.STATIONS[:n], stations.DIODES, T)
    return stations.sight(stations.STATIONS[:n], stations.DIODES, angles + std * rng.normal(size=angles.shape), T)


def test_the_pose_is_that_of_another_minimizer():
    rng = np.random.default_rng(3)
    found = noisy_sight(2, 1e-4, rng)

    def residuals(x):
        T = pose(T_BE[3][:3, :3] @ Rotation.from_rotvec(x[:3]).as_matrix(), T_BE[3][:3, 3] + 1000 * x[3:])
        return 1e4 * (stations.body_angles(stations.STATIONS, stations.DIODES, T) - found.angles).ravel()

    x = least_squares(residuals, np.zeros(6), xtol=1e-15, ftol=1e-15, gtol=1e-15).x
    np.testing.assert_allclose(found.T_WE[:3, 3], T_BE[3][:3, 3] + 1000 * x[3:], atol=1e-4)


def test_covariance_of_a_pose_is_that_of_many_trials():
    """Squared errors in standard deviations, summed over 100 trials: chi-square with 600 degrees of freedom."""
    rng, std = np.random.default_rng(4), 5e-5
    found = [noisy_sight(2, std, rng) for _ in range(100)]
    errors = np.array(
        [
            np.r_[Rotation.from_matrix(T_BE[3][:3, :3].T @ f.T_WE[:3, :3]).as_rotvec(), (f.T_WE - T_BE[3])[:3, 3]]
            for f in found
        ]
    )
    known = stations.sight(stations.STATIONS, stations.DIODES, found[0].angles, T_BE[3], std=std)
    cov = known.covariance
    np.testing.assert_allclose(cov, found[0].covariance * (std / found[0].std) ** 2)
    total = np.einsum("ni,ij,nj->", errors, np.linalg.inv(cov), errors)
    assert 1e-4 < chi2.cdf(total, 600) < 1 - 1e-4
    assert np.mean([f.std for f in found]) == pytest.approx(std, rel=0.05)


def test_six_angles_fit_exactly_and_say_nothing_of_their_noise():
    L, diodes = stations.STATIONS[:1], stations.DIODES[:3]
    angles = stations.body_angles(L, diodes, T_BE[3])
    found = stations.sight(L, diodes, angles, T_BE[3])
    assert np.isnan(found.std) and np.isnan(found.std_of("T_WE.translation")).all()
    known = stations.sight(L, diodes, angles, T_BE[3], std=5e-5)
    assert known.std == 5e-5 and (known.std_of("T_WE.translation") > 0).all()


def test_one_station_is_poor_in_depth_alone():
    """Across the line of sight both are alike; along it the second station is worth a factor of ten and more."""
    one, two = (noisy_sight(n, 5e-5, np.random.default_rng(0)) for n in (1, 2))
    depth = stations.STATIONS[0][:3, 3] - T_BE[3][:3, 3]
    depth /= np.linalg.norm(depth)
    std = [np.sqrt(depth @ s.covariance_of("T_WE.translation") @ depth) / s.std for s in (one, two)]
    assert std[0] > 10 * std[1]
    assert one.singular_values[-1] < two.singular_values[-1]


def test_singular_values_are_those_of_directions_without_lengths():
    """Each column of the derivative, by differences, has length 1: their squares add up to six."""
    found, h = noisy_sight(2, 1e-4, np.random.default_rng(5)), np.repeat([1e-5, 1e-2], 3)
    columns = []
    for e in np.diag(h):
        ahead, behind = (
            pose(found.T_WE[:3, :3] @ Rotation.from_rotvec(s * e[:3]).as_matrix(), found.T_WE[:3, 3] + s * e[3:])
            for s in (1, -1)
        )
        ahead, behind = (stations.body_angles(stations.STATIONS, stations.DIODES, T).ravel() for T in (ahead, behind))
        columns.append((ahead - behind) / np.linalg.norm(ahead - behind))
    np.testing.assert_allclose(found.singular_values, np.linalg.svd(np.transpose(columns))[1], rtol=1e-6)


def test_stations_that_move_together_move_the_world():
    move = pose(Rotation.from_rotvec([0.02, -0.01, 0.03]).as_matrix(), [5.0, -3.0, 2.0])
    read = stations.read_poses(T_BE, stations.STATIONS, move @ stations.STATIONS, np.random.default_rng(0))
    turn, off = pose_distance(read, invert(move) @ T_BE)
    assert turn.max() < 1e-9 and off.max() < 1e-6


def e_trans(mrad, since):
    """E_trans (mm) and the error of the mounting (mm) when station 2 tilts by `mrad` from a stop on."""
    actual = np.repeat(stations.STATIONS[None], len(T_BE), axis=0)
    actual[since:, 1] = stations.tilted(stations.STATIONS[1], [0, 1e-3 * mrad, 0])
    read = stations.read_poses(T_BE, stations.STATIONS, actual, np.random.default_rng(0))
    found = calibrate_mounting(T_BF, invert(read[0]) @ read, factor=1e9)
    return found.E_trans, np.linalg.norm(found.T_FE[:3, 3] - simulation.T_FE[:3, 3])


def test_a_station_that_moves_during_the_run_shows_and_one_that_moved_before_does_not():
    during, before = e_trans(2.0, since=11), e_trans(2.0, since=0)
    assert during[0] > 10 * before[0] and during[1] > 10 * before[1]
    assert e_trans(0.0, since=11)[0] < 1e-9
    assert e_trans(1.0, since=11)[0] == pytest.approx(during[0] / 2, rel=0.02)  # small tilts: proportional


def test_the_diodes_sit_on_a_dome_of_90_mm():
    """A ring of five about the axis at even turns, one on top, three between; none hides another's direction."""
    d = stations.DIODES / 45.0
    np.testing.assert_allclose(np.linalg.norm(stations.DIODES, axis=1), 45.0)
    ring = np.arctan2(d[:5, 1], d[:5, 0])
    np.testing.assert_allclose(np.rad2deg(ring), [0, 72, 144, -144, -72], atol=1.5)
    np.testing.assert_allclose(d[8], [0, 0, 1])
    assert (np.rad2deg(np.arcsin(d[:5, 2])) < 12).all() and (d[5:8, 2] > 0.75).all() and (d[:, 2] > 0.15).all()
    assert np.linalg.norm(d[5:8, :2].sum(0)) < 0.15  # the three between balance each other


def test_rays_may_lie_far_off_the_axis():
    for angle in np.deg2rad([65.0, 89.0]):
        d = stations.ray_direction([angle, 0.0])
        np.testing.assert_allclose(d, [np.sin(angle), 0.0, np.cos(angle)], atol=1e-12)


@pytest.mark.parametrize("n", [2, 200])
def test_how_parallel_rays_may_be_does_not_depend_on_their_number(n):
    """Half of them tilted by some millionths: N has the least eigenvalue n / 4 times its square."""
    for tilt, refused in ((1.6e-6, True), (2.5e-6, False)):
        d = np.tile([[0.0, 0, 1], [0, tilt, 1]], (n // 2, 1))
        if refused:
            with pytest.raises(ValueError, match="not parallel"):
                stations.nearest_to_rays(np.zeros((n, 3)), d)
        else:
            np.testing.assert_allclose(stations.nearest_to_rays(np.tile([1.0, 2, 3], (n, 1)), d), [1, 2, 3], atol=1e-3)


def test_one_of_the_stations_may_stand_at_the_origin():
    L = invert(stations.STATIONS[0]) @ stations.STATIONS
    T = invert(stations.STATIONS[0]) @ T_BE
    found = stations.poses_from_angles(L, stations.DIODES, stations.body_angles(L, stations.DIODES, T), T @ T_NEAR)
    turn, off = pose_distance(found, T)
    assert turn.max() < 1e-7 and off.max() < 1e-4


T_NEAR = pose(Rotation.from_rotvec([0.05, -0.02, 0.04]).as_matrix(), [10.0, -5.0, 8.0])


def test_readings_scatter_as_the_angles_do():
    """Squared errors in standard deviations: chi-square with six degrees a pose, at odds of 1e-4; a fixed seed."""
    std, still = 5e-5, np.repeat(T_BE[3:4], 60, axis=0)
    read = stations.read_poses(still, stations.STATIONS, stations.STATIONS, np.random.default_rng(2), std)
    errors = np.c_[Rotation.from_matrix(T_BE[3, :3, :3].T @ read[:, :3, :3]).as_rotvec(), (read - T_BE[3])[:, :3, 3]]
    angles = stations.body_angles(stations.STATIONS, stations.DIODES, T_BE[3])
    cov = stations.sight(stations.STATIONS, stations.DIODES, angles, T_BE[3], std=std).covariance
    total = np.einsum("ni,ij,nj->", errors, np.linalg.inv(cov), errors)
    assert 5e-5 < chi2.cdf(total, 360) < 1 - 5e-5
