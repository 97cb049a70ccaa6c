"""Difference quotients beside derivatives in closed form: both schemes, a step for each number, curved spaces."""

import numpy as np
import pytest

from labkit.estimation.differences import numeric_jacobian

X = np.array([0.4, -1.2, 2.0])


def function(x):
    return np.array([np.sin(x[0]) * x[1], np.exp(x[2]) + x[0] ** 2])


def jacobian(x):
    return np.array([[np.cos(x[0]) * x[1], np.sin(x[0]), 0.0], [2 * x[0], 0.0, np.exp(x[2])]])


@pytest.mark.parametrize(("scheme", "order"), [("forward", 1), ("central", 2)])
def test_the_error_shrinks_with_the_step_to_the_scheme_s_power(scheme, order):
    errors = [np.abs(numeric_jacobian(function, X, h, scheme=scheme) - jacobian(X)).max() for h in (1e-2, 1e-3)]
    assert errors[0] / errors[1] == pytest.approx(10**order, rel=0.1)


@pytest.mark.parametrize("scheme", ["forward", "central"])
def test_each_number_has_its_own_step(scheme):
    asked = []

    def spy(x):
        asked.append(x - X)
        return function(x)

    found = numeric_jacobian(spy, X, [1e-5, 1e-3, 1e-4], scheme=scheme)
    np.testing.assert_allclose(found, jacobian(X), rtol=1e-2, atol=1e-3)
    sizes = np.abs(asked).max(0)
    np.testing.assert_allclose(sizes, [1e-5, 1e-3, 1e-4], rtol=1e-6)
    assert all(np.count_nonzero(np.abs(step) > 1e-12) <= 1 for step in asked)


def test_a_number_of_a_number():
    np.testing.assert_allclose(numeric_jacobian(lambda x: x[0] ** 3, np.array([2.0])), [12.0], rtol=1e-6)


def test_refusals():
    with pytest.raises(ValueError, match="shapes"):
        numeric_jacobian(function, X, [1e-3, 1e-3])
    with pytest.raises(ValueError, match="scheme must be one of"):
        numeric_jacobian(function, X, scheme="backward")
