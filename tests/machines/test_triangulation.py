"""Height from two angles: against the printed formula, construction, SciPy's derivative and Monte Carlo."""

import numpy as np
import pytest

from labkit.machines import triangulation as tri


def random_triangles(n=200, seed=0):
    rng = np.random.default_rng(seed)
    base = rng.uniform(20, 200, n)
    place = np.column_stack([rng.uniform(-50, 250, n), rng.uniform(30, 400, n)])
    return place, base


def test_a_place_comes_back_from_its_angles():
    place, base = random_triangles()
    alpha, beta = tri.angles_to(place, base)
    assert tri.place_from_angles(alpha, beta, base) == pytest.approx(place, rel=1e-9, abs=1e-9)


def test_the_height_is_the_printed_formula():
    place, base = random_triangles()
    alpha, beta = tri.angles_to(place, base)
    a, b = np.tan(alpha), np.tan(beta)
    assert tri.height_from_angles(alpha, beta, base) == pytest.approx(base * a * b / (a + b), rel=1e-9)
    assert tri.height_from_angles(np.pi / 2, np.pi / 4, 70.0) == pytest.approx(70.0)
    assert tri.height_from_angles(np.pi / 3, np.pi / 3, 2.0) == pytest.approx(np.sqrt(3))


def test_the_height_of_a_known_triangle():
    # a 3-4-5 triangle: height over the hypotenuse 12 / 5
    assert tri.height_from_angles(np.arctan2(4, 3), np.arctan2(3, 4), 5.0) == pytest.approx(2.4)
    assert tri.height_from_angles(np.pi / 4, np.pi / 2, 2.0) == pytest.approx(2.0)  # where tan has no value


@pytest.mark.parametrize("base, alpha, beta", [(100.0, 1.2, 1.4), (50.0, 0.6, 2.0)])
def test_the_standard_deviation_is_the_derivative(base, alpha, beta):
    h, H = 1e-6, tri.height_from_angles
    by_a = (H(alpha + h, beta, base) - H(alpha - h, beta, base)) / (2 * h)
    by_b = (H(alpha, beta + h, base) - H(alpha, beta - h, base)) / (2 * h)
    assert tri.height_std(alpha, beta, base, 1e-3) == pytest.approx(1e-3 * np.hypot(by_a, by_b), rel=1e-7)


def test_derivatives_are_differences():
    place, base = random_triangles(50)
    alpha, beta = tri.angles_to(place, base)
    h = 1e-6
    by_alpha = (tri.height_from_angles(alpha + h, beta, base) - tri.height_from_angles(alpha - h, beta, base)) / (2 * h)
    by_beta = (tri.height_from_angles(alpha, beta + h, base) - tri.height_from_angles(alpha, beta - h, base)) / (2 * h)
    found = tri.height_derivatives(alpha, beta, base)
    assert found[0] == pytest.approx(by_alpha, rel=1e-5) and found[1] == pytest.approx(by_beta, rel=1e-5)


def test_the_error_of_the_height_is_what_noisy_angles_give():
    """100 000 draws tell a standard deviation to 0.22 %; 1.5 % is almost seven of that."""
    rng, std = np.random.default_rng(1), np.deg2rad(0.02)
    alpha, beta = tri.angles_to([0.0, 240.0], 100.0)
    noisy = tri.height_from_angles(alpha + std * rng.normal(size=100_000), beta + std * rng.normal(size=100_000), 100.0)
    assert noisy.std() == pytest.approx(tri.height_std(alpha, beta, 100.0, std), rel=0.015)


def test_twice_as_far_is_nearly_four_times_as_bad():
    near, far = (tri.height_std(*tri.angles_to([0.0, H], 100.0), 100.0, 1e-4) for H in (240.0, 480.0))
    assert 3.2 < far / near < 4


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: tri.height_from_angles(2.0, 1.5, 100.0), "never meet"),
        (lambda: tri.height_from_angles(-0.1, 1.0, 100.0), "never meet"),
        (lambda: tri.height_from_angles(np.pi / 2, np.pi / 2, 1.0), "must stay below 180 deg, got 180"),
        (lambda: tri.height_from_angles(1.0, 1.0, 0.0), "base"),
        (lambda: tri.height_std(1.0, 1.0, 100.0, -1.0), "std"),
        (lambda: tri.height_std(1.0, np.nan, 100.0, 1.0), "beta"),
    ],
)
def test_what_makes_no_triangle_is_refused(call, words):
    with pytest.raises(ValueError, match=words):
        call()


def test_the_linearity_of_the_data_sheet():
    """0.16 % of the range of 100 mm are three standard deviations."""
    assert np.isclose(3 * tri.LINEARITY, 0.0016 * np.ptp(tri.RANGE)) and np.ptp(tri.RANGE) == 100.0


def test_what_makes_no_triangle_is_told_by_the_worst():
    with pytest.raises(ValueError, match="got 190 deg"):
        tri.height_from_angles(np.deg2rad([100.0, 40.0]), np.deg2rad([90.0, 40.0]), 100.0)
    with pytest.raises(ValueError, match="squared sine"):
        tri.height_derivatives(1e-200, 1.0, 100.0)
