"""Frames, transforms and KUKA angles against SciPy, closed forms and Monte Carlo."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from labkit.checks import as_transforms
from labkit.documents.lab_sheet.printed import points
from labkit.geometry import frames, lie
from labkit.geometry.chaining import orthonormality_error

RNG = np.random.default_rng(5)
TRIPLES = RNG.normal(size=(3, 50, 3)) * 100


def random_poses(n, rng=RNG):
    return frames.pose(Rotation.random(n, rng).as_matrix(), rng.normal(size=(n, 3)) * 300)


def test_gram_schmidt_against_qr():
    a, b = RNG.normal(size=(2, 20, 3))
    for k in range(20):
        Q, U = np.linalg.qr(np.column_stack([a[k], b[k]]))
        xy = Q * np.sign(np.diag(U))
        R = frames.gram_schmidt(a[k], b[k])
        np.testing.assert_allclose(R[:, :2], xy, atol=1e-12)
        assert np.linalg.det(R) == pytest.approx(1)


def test_frame_has_its_points_where_they_belong():
    T = frames.frame_from_points(*TRIPLES)
    local = [frames.transform(frames.invert(T), p) for p in TRIPLES]
    np.testing.assert_allclose(local[0], 0, atol=1e-9)
    np.testing.assert_allclose(local[1][:, 1:], 0, atol=1e-9)
    np.testing.assert_allclose(local[2][:, 2], 0, atol=1e-9)
    assert (local[1][:, 0] > 0).all() and (local[2][:, 1] > 0).all()


def test_frames_broadcast_like_a_loop():
    together = frames.frame_from_points(*TRIPLES)
    one_by_one = [frames.frame_from_points(*triple) for triple in TRIPLES.swapaxes(0, 1)]
    np.testing.assert_allclose(together, one_by_one, atol=1e-14)
    shared = frames.frame_from_points(TRIPLES[0, 0], TRIPLES[1], TRIPLES[2])
    assert shared.shape == (50, 4, 4)


@pytest.mark.parametrize(
    "origin, x_point, y_point, words",
    [
        ((0, 0, 0), (1, 0, 0), (2, 0, 0), "collinear: the angle between the arms is 0 deg"),
        ((0, 0, 0), (1, 0, 0), (-1, 1e-6, 0), r"collinear: the angle between the arms is 5.7e-05 deg"),
        ((5, 5, 5), (5, 5, 5), (2, 0, 0), "x_point coincides with origin"),
        ((5, 5, 5), (1, 0, 0), (5, 5, 5), "y_point coincides with origin"),
        ((1e9, 0, 0), (1e9 + 1e-7, 0, 0), (1e9, 1, 0), "x_point coincides with origin"),
        ((0, 0, np.nan), (1, 0, 0), (0, 1, 0), r"origin must be finite, got nan at index \[2\]"),
        ((0, 0), (1, 0, 0), (0, 1, 0), r"origin must have shape \(..., 3\), got \(2,\)"),
        ("abc", (1, 0, 0), (0, 1, 0), "origin must hold real numbers, got text"),
        ((0, 0, 1j), (1, 0, 0), (0, 1, 0), "origin must hold real numbers, got complex numbers"),
        ((0, 0, 0), (1e200, 0, 0), (0, 1, 0), r"x_point must hold numbers below 1e\+75, got 1e\+200"),
        ((1e308, 0, 0), (-1e308, 0, 0), (0, 1, 0), "origin must hold numbers below"),
    ],
)
def test_bad_points_are_refused_with_what_arrived(origin, x_point, y_point, words):
    with pytest.raises(ValueError, match=words):
        frames.frame_from_points(origin, x_point, y_point)


def test_one_flat_triangle_in_a_batch_is_refused():
    o, px, py = TRIPLES.copy()
    py[17] = o[17] + 2 * (px[17] - o[17])
    with pytest.raises(ValueError, match="collinear"):
        frames.frame_from_points(o, px, py)


def test_the_flattest_triangles_let_in_still_give_a_frame():
    """The rounding of a unit vector, in its three entries and twice, weighs more the flatter the triangle."""
    angle = np.deg2rad(2e-3)
    height = np.tan(angle) * 100
    rounding = 6 * np.finfo(float).eps / angle
    tilt = Rotation.from_euler("xyz", (0.3, -0.8, 1.1)).as_matrix()
    T = frames.frame_from_points(np.zeros(3), tilt @ (100, 0, 0), tilt @ (100, height, 0))
    np.testing.assert_allclose(T[:3, :3].T @ T[:3, :3], np.eye(3), atol=rounding)
    assert frames.rotation_angle(T[:3, :3].T @ tilt) < 2 * rounding


@pytest.mark.parametrize("size", [1e-200, 1e-70, 1.0, 1e70])
def test_the_unit_of_length_does_not_matter(size):
    o, px, py = TRIPLES
    R = frames.gram_schmidt(size * (px - o), py - o)
    np.testing.assert_allclose(R, frames.gram_schmidt(px - o, py - o), atol=1e-13)
    T = frames.frame_from_points(size * o, size * px, size * py)
    np.testing.assert_allclose(T[:, :3, :3], R, atol=1e-11)
    np.testing.assert_array_equal(T[:, :3, 3], size * o)
    np.testing.assert_allclose(np.linalg.norm(frames.unit_vector(size * px), axis=-1), 1, rtol=1e-15)


def test_quaternions_against_scipy_and_back():
    R = Rotation.random(30, RNG).as_matrix()
    xyzw = frames.quaternion_from_matrix(R.reshape(5, 6, 3, 3))
    assert xyzw.shape == (5, 6, 4) and (xyzw[..., 3] >= 0).all()
    np.testing.assert_allclose(frames.matrix_from_quaternion(xyzw), R.reshape(5, 6, 3, 3), atol=1e-14)
    half = frames.quaternion_from_matrix(lie.exp_so3([0.0, 0.0, np.pi / 2]))
    np.testing.assert_allclose(half, [0, 0, np.sqrt(0.5), np.sqrt(0.5)], atol=1e-15)
    assert frames.quaternion_from_matrix(np.zeros((0, 3, 3))).shape == (0, 4)


def test_normalize_and_zero():
    np.testing.assert_allclose(np.linalg.norm(frames.unit_vector(RNG.normal(size=(7, 5))), axis=-1), 1)
    with pytest.raises(ValueError, match="zero vector"):
        frames.unit_vector(np.zeros(3))


def test_gram_schmidt_refuses_parallel_and_zero():
    with pytest.raises(ValueError, match="a and b are parallel: the angle between the arms is 0 deg"):
        frames.gram_schmidt((1, 2, 3), (-2, -4, -6))
    with pytest.raises(ValueError, match="b is zero"):
        frames.gram_schmidt((1, 2, 3), (0, 0, 0))


def test_invert_and_relative_against_solve():
    A, B = random_poses(30), random_poses(30)
    np.testing.assert_allclose(frames.invert(A), np.linalg.inv(A), atol=1e-10)
    np.testing.assert_allclose(frames.relative(A, B), np.linalg.solve(A, B), atol=1e-10)
    np.testing.assert_allclose(frames.relative(A, A), np.broadcast_to(np.eye(4), (30, 4, 4)), atol=1e-10)


@pytest.mark.parametrize(
    "T, words",
    [
        (np.diag([1.0, 1, 2, 1]), "orthonormal rotation block"),
        (np.diag([1.0, 1, -1, 1]), "right-handed"),
        (np.eye(4) + np.eye(4)[:, ::-1] * 0.1, "last row 0 0 0 1"),
        (np.eye(3), r"shape \(..., 4, 4\), got \(3, 3\)"),
        (np.full((4, 4), np.nan), "finite"),
    ],
)
def test_no_transform_is_refused(T, words):
    with pytest.raises(ValueError, match=words):
        frames.invert(T)


def test_transform_points_against_homogeneous_coordinates():
    T, p = random_poses(6), RNG.normal(size=(6, 3))
    expected = np.einsum("nij,nj->ni", T, np.c_[p, np.ones(6)])[:, :3]
    np.testing.assert_allclose(frames.transform(T, p), expected, atol=1e-10)
    np.testing.assert_allclose(frames.transform(T[:, None], p).shape, (6, 6, 3))


@given(st.floats(0, np.pi), st.integers(0, 10**6))
@settings(max_examples=60, deadline=None)
def test_rotation_angle_is_accurate_from_0_to_pi(angle, seed):
    axis = frames.unit_vector(np.random.default_rng(seed).normal(size=3))
    R = Rotation.from_rotvec(angle * axis).as_matrix()
    assert frames.rotation_angle(R) == pytest.approx(angle, abs=1e-14, rel=1e-9)


def test_pose_distance():
    T = random_poses(5)
    moved = T @ frames.pose(Rotation.from_rotvec([0, 0, 0.2]).as_matrix(), (3, 4, 0))
    angle, distance = frames.pose_distance(T, moved)
    np.testing.assert_allclose(angle, 0.2)
    np.testing.assert_allclose(distance, 5)


def test_kuka_against_scipy():
    xyzabc = np.c_[RNG.normal(size=(40, 3)), RNG.uniform(-np.pi, np.pi, (40, 3))]
    T = frames.matrix_from_kuka(xyzabc)
    np.testing.assert_allclose(T[:, :3, :3], Rotation.from_euler("ZYX", xyzabc[:, 3:]).as_matrix(), atol=1e-14)
    np.testing.assert_allclose(T[:, :3, 3], xyzabc[:, :3])


B_VALUES = [s * (np.pi / 2 - e) for s in (1, -1) for e in (0, 1e-15, 1e-9, 1e-7, 1e-5, 0.1)]


@pytest.mark.parametrize("b", B_VALUES)
def test_kuka_round_trip_returns_the_pose_also_at_the_pole(b):
    abc = np.c_[RNG.uniform(-np.pi, np.pi, 50), np.full(50, b), RNG.uniform(-np.pi, np.pi, 50)]
    T = frames.matrix_from_kuka(np.c_[RNG.normal(size=(50, 3)), abc])
    back = frames.matrix_from_kuka(frames.kuka_from_matrix(T))
    np.testing.assert_allclose(back, T, atol=1e-14)
    assert (np.abs(frames.kuka_from_matrix(T)[:, 4]) <= np.pi / 2 + 1e-12).all()


def test_kuka_angles_are_unique_away_from_the_pole():
    abc = RNG.uniform((-3, -1.5, -3), (3, 1.5, 3), (50, 3))
    xyzabc = np.c_[RNG.normal(size=(50, 3)), abc]
    np.testing.assert_allclose(frames.kuka_from_matrix(frames.matrix_from_kuka(xyzabc)), xyzabc, atol=1e-12)


def test_kuka_from_degrees():
    radians = frames.kuka_from_degrees([1, 2, 3, 180, 90, -45])
    np.testing.assert_allclose(radians, [1, 2, 3, np.pi, np.pi / 2, -np.pi / 4])


def test_quaternion_against_scipy():
    q = RNG.normal(size=(20, 4))
    np.testing.assert_allclose(frames.matrix_from_quaternion(q), Rotation.from_quat(q).as_matrix(), atol=1e-14)
    np.testing.assert_allclose(frames.matrix_from_quaternion([[0, 0, 0, 2.0], [0, 3.0, 0, 0]])[1], np.diag([-1, 1, -1]))
    for q in ([0, 0, 0, 0], [[0, 0, 0, 1], [0, 0, 0, 0]]):
        with pytest.raises(ValueError, match="zero quaternion"):
            frames.matrix_from_quaternion(q)


def test_fit_frame_against_scipy_and_on_exact_points():
    p, T = RNG.normal(size=(6, 3)) * 50, random_poses(1)[0]
    np.testing.assert_allclose(frames.fit_frame(p, frames.transform(T, p)), T, atol=1e-9)
    noisy = frames.transform(T, p) + RNG.normal(size=(6, 3))
    R, _ = Rotation.align_vectors(noisy - noisy.mean(0), p - p.mean(0))
    np.testing.assert_allclose(frames.fit_frame(p, noisy)[:3, :3], R.as_matrix(), atol=1e-6)


def test_fit_frame_refuses_a_line_and_too_few_points():
    line = np.outer([0.0, 1, 2], [1, 1, 0])
    with pytest.raises(ValueError, match="collinear: the second singular value"):
        frames.fit_frame(line, line)
    with pytest.raises(ValueError, match="collinear: the second singular value"):
        frames.fit_frame(1e6 * line, 1e6 * line)
    triangle = 1e-4 * np.array([[0.0, 0, 0], [3, 0, 0], [0, 2, 0]])  # small is not flat
    np.testing.assert_allclose(frames.fit_frame(triangle, triangle), np.eye(4), atol=1e-9)
    nearly = line + 1e-7 * np.array([[0.0, 0, 1], [0, 0, -2], [0, 0, 1]])  # across the line: 3e-14 along it, squared
    with pytest.raises(ValueError, match=r"singular value is 1\.5e-14 of the first"):
        frames.fit_frame(np.array([50 * triangle, nearly]), np.array([50 * triangle, nearly]))
    with pytest.raises(ValueError, match="at least 3 points are needed, got 2"):
        frames.fit_frame(line[:2], line[:2])
    with pytest.raises(ValueError, match=r"leading axes .* \(2,\) of T, \(3,\) of points"):
        frames.transform(np.tile(np.eye(4), (2, 1, 1)), np.zeros((3, 3)))


@pytest.mark.parametrize("c, u, h", [(100, 30, 40), (100, 0, 10), (80, 120, 60)])
def test_bounds_against_monte_carlo(c, u, h):
    std, rng = 0.05, np.random.default_rng(9)
    triangle = np.array([[0, 0, 0], [c, 0, 0], [u, h, 0]], dtype=float)
    measured = triangle + std * rng.normal(size=(20_000, 3, 3))
    phi = lie.log_so3(frames.frame_from_points(*measured.swapaxes(0, 1))[:, :3, :3])
    expected = frames.gram_schmidt_covariance(c, u, h, std)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    np.testing.assert_allclose(np.cov(phi.T) / scale, expected / scale, atol=0.04)
    phi = lie.log_so3(frames.fit_frame(triangle, measured)[:, :3, :3])
    bound = frames.fit_covariance(triangle, std)
    scale = np.sqrt(np.outer(np.diag(bound), np.diag(bound)))
    np.testing.assert_allclose(np.cov(phi.T) / scale, bound / scale, atol=0.04)


def test_the_bound_holds_and_only_the_turn_in_the_plane_gains():
    triangle = np.array([[0, 0, 0], [100, 0, 0], [30, 40, 0.0]])
    gs = np.diag(frames.gram_schmidt_covariance(100, 30, 40, 0.05))
    bound = np.diag(frames.fit_covariance(triangle, 0.05))
    np.testing.assert_allclose(gs[:2], bound[:2])
    assert gs[2] > 1.2 * bound[2]
    np.testing.assert_allclose(
        frames.fit_covariance(1e-8 * triangle, 0.05), 1e16 * frames.fit_covariance(triangle, 0.05)
    )
    with pytest.raises(ValueError, match="collinear or coincide"):
        frames.fit_covariance(1e-178 * triangle, 0.05)  # whose squares are 0


def test_the_six_points_are_the_printed_ones():
    assert points()["K0"].tolist() == [[1.01, 2, 0], [2, 2, 0], [1, 3, 0]]
    assert points()["K1"].tolist() == [[2, 1, 0], [2.01, 2, 0], [1, 1, 0]]


@pytest.mark.parametrize("shear", [0.0, 1e-8, 1e-5, 9e-4, 1.1e-3, 0.1])
@pytest.mark.parametrize("spoil", ["columns 0 and 1", "columns 1 and 2", "columns 2 and 0", "length", "all lengths"])
def test_the_quick_look_at_a_stack_passes_nothing_that_a_single_pose_fails(shear, spoil):
    T = random_poses(5)
    R = T[:, :3, :3]
    if spoil.startswith("columns"):
        i, j = int(spoil[8]), int(spoil[-1])
        R[2, :, j] += shear * R[2, :, i]
        R[2] /= np.linalg.norm(R[2], axis=0)
    else:
        R[2, :, 0 if spoil == "length" else slice(None)] *= 1 + shear / 2
    if orthonormality_error(T[2]) > 1e-3:
        for poses in (T, T[2]):
            with pytest.raises(ValueError, match="orthonormal"):
                as_transforms(poses, "T")
    else:
        assert as_transforms(T, "T") is T and as_transforms(T[2], "T").shape == (4, 4)


def test_a_pose_moves_by_a_turn_of_its_own_axes_and_a_shift_of_its_origin():
    T = frames.pose(Rotation.from_rotvec([0.3, -0.4, 1.0]).as_matrix(), [1.0, 2.0, 3.0])
    found = frames.moved(T, [0.1, 0.0, -0.2, 10.0, -20.0, 5.0])
    np.testing.assert_allclose(found[:3, :3], T[:3, :3] @ Rotation.from_rotvec([0.1, 0.0, -0.2]).as_matrix())
    np.testing.assert_allclose(found[:3, 3], [11.0, -18.0, 8.0])
