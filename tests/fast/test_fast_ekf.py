"""The fast landmark filter equals the readable one, for one robot and many, and refuses alike."""

import numpy as np
import pytest

from labkit.fast import ekf as fast
from labkit.localization import ekf

RUNS, STEPS = 3, 30
LANDMARKS = np.array([[4.0, 6.0], [-5.0, 4.0], [-3.0, -6.0], [6.0, -3.0]])
COV_U, STD_RANGE, STD_BEARING = np.diag([0.05**2, np.radians(3) ** 2]), 0.1, np.radians(1)
COV0 = np.diag([0.1**2, 0.1**2, np.radians(3) ** 2])
COV_V = 1e-4 * np.array([[2.0, 0.5, 0.1], [0.5, 1.0, -0.2], [0.1, -0.2, 0.3]])
U = np.random.default_rng(0).uniform([0.2, -1.0], [1.5, 1.0], (STEPS, 2))


def simulated(marks=LANDMARKS, reach=7.0, model="euler"):
    rng = np.random.default_rng(1)
    return ekf.simulate_drive(
        np.zeros(3), U, 0.1, COV_U, marks, STD_RANGE, STD_BEARING, rng, RUNS, model=model, reach=reach
    ).z


def both(u, z, marks=LANDMARKS, x0=(0.0, 0.0, 0.0), cov0=COV0, atol=1e-9, **more):
    """Assert that both filters agree on many robots at once and on each alone; the fast result of the many."""
    given = {"cov_u": COV_U} | more
    u, x0, cov0 = np.asarray(u), np.asarray(x0), np.asarray(cov0)
    runs = [(u, z, x0, cov0)]
    for k in range(z.shape[1]):
        one = (
            u[:, k] if u.ndim == 3 else u,
            z[:, k],
            x0[k] if x0.ndim == 2 else x0,
            cov0[k] if cov0.ndim == 3 else cov0,
        )
        runs.append(one)
    for u_, z_, x0_, cov0_ in runs:
        pair = [f.ekf_localize(u_, z_, marks, x0_, cov0_, 0.1, STD_RANGE, STD_BEARING, **given) for f in (fast, ekf)]
        for name in ("x", "cov", "nis", "dof"):
            found, expected = (getattr(result, name) for result in pair)
            assert found.shape == expected.shape, name
            np.testing.assert_allclose(found, expected, rtol=1e-9, atol=atol, err_msg=name)
    return fast.ekf_localize(u, z, marks, x0, cov0, 0.1, STD_RANGE, STD_BEARING, **given)


@pytest.mark.parametrize("model", ["euler", "midpoint"])
def test_equals_the_readable_filter(model):
    z = simulated(model=model)
    assert np.isnan(z).any() and np.isfinite(z).any()
    found = both(U, z, model=model)
    assert found.x.shape == (STEPS, RUNS, 3)
    both(U, z, model=model, cov_v=COV_V, wrap=False)
    both(U, z, model=model, cov_u=np.linspace(0.1, 2, STEPS)[:, None, None] * COV_U)


def test_equals_it_with_one_landmark_and_with_none():
    both(U, simulated(LANDMARKS[:1], np.inf), LANDMARKS[:1])
    unseen = both(U, np.full((STEPS, RUNS, 4, 2), np.nan))
    assert (unseen.dof == 0).all() and (unseen.nis == 0).all()
    both(U, np.zeros((STEPS, RUNS, 0, 2)), np.zeros((0, 2)))


@pytest.mark.parametrize(
    "cov0, atol",
    [
        (np.zeros((3, 3)), 1e-9),
        (np.diag([1e-14, 1.0, 1e-3]), 1e-9),
        (np.outer([1.0, 2.0, 0.1], [1.0, 2.0, 0.1]), 1e-9),
        (np.diag([1e4, 1e4, 10.0]), 1e-5),
    ],
    ids=["known", "nearly singular", "of rank one", "hardly known"],
)
def test_equals_it_whatever_is_known_of_the_start(cov0, atol):
    both(U, simulated(), cov0=cov0, atol=atol)
    both(U, simulated(), cov0=cov0, cov_u=None, atol=atol)
    both(U, simulated(), cov0=cov0, cov_u=np.diag([0.0, 0.01]), atol=atol)


def test_equals_it_with_a_start_a_covariance_and_commands_per_run():
    rng = np.random.default_rng(2)
    u = np.stack([U * scale for scale in (0.8, 1.0, 1.2)], axis=1)
    x0 = 0.1 * rng.standard_normal((RUNS, 3))
    both(u, simulated(), x0=x0, cov0=COV0 * np.array([0.5, 1, 4])[:, None, None])


def test_equals_it_on_single_precision():
    z = simulated().astype(np.float32)
    found = both(U.astype(np.float32), z, LANDMARKS.astype(np.float32), cov0=COV0.astype(np.float32))
    assert found.x.dtype == np.float64


def test_hands_over_what_it_does_not_tune():
    both(U[:5], simulated()[:5], cov_u=COV_U + 1e-4)
    both(U[:5], simulated()[:5], model="arc")


def test_no_step_is_no_pose():
    assert both(np.zeros((0, 2)), np.zeros((0, RUNS, 4, 2))).cov.shape == (0, RUNS, 3, 3)


def straight(z, **more):
    """1 m/s straight on in half seconds: the third step ends on the first of two landmarks."""
    marks = np.array([[1.5, 0.0], [9.0, 9.0]])
    return (np.tile([1.0, 0.0], (4, 1)), z, marks, np.zeros(3), COV0, 0.5, 0.1, 0.1), more


UNSEEN, SEEN = np.full((4, 2, 2), np.nan), np.full((4, 2, 2), np.nan)
SEEN[2, 0] = 0.0
HALF = np.array(UNSEEN)
HALF[1, 1, 0] = 2.0


@pytest.mark.parametrize(
    "given",
    [
        straight(UNSEEN),
        straight(SEEN),
        straight(np.repeat(UNSEEN[:, None], 2, axis=1)),
        straight(np.repeat(SEEN[:, None], 2, axis=1)),
        straight(HALF),
        straight(UNSEEN[:3]),
        straight(UNSEEN, model="straight"),
        straight(UNSEEN, cov_u=-np.eye(2)),
        straight(UNSEEN, cov_v=np.eye(2)),
        ((np.zeros((2, 2)), np.zeros((2, 3, 4, 2)), LANDMARKS, np.zeros(3), np.tile(COV0, (5, 1, 1)), 0.1, 1, 1), {}),
        ((np.zeros((2, 2)), np.zeros((2, 3, 4, 2)), LANDMARKS, np.zeros(3), COV0, 0.0, 1, 1), {}),
        ((np.zeros((2, 2)), np.zeros((2, 3, 4, 2)), LANDMARKS, np.zeros(3), COV0, 0.1, -1, 1), {}),
    ],
)
def test_refuses_in_the_same_words(given):
    said = []
    for module in (ekf, fast):
        with pytest.raises(ValueError) as refusal:
            module.ekf_localize(*given[0], **given[1])
        said.append(str(refusal.value))
    assert said[0] == said[1]


def test_equals_it_where_readings_are_half_a_turn_off():
    """Innovations of the bearing over the whole circle, wrapped or not; one step, as what follows is chaos."""
    z = simulated(LANDMARKS[:1], np.inf)[:1]
    for off in (1.9, -2.8, 4.0, -7.0):
        wrong = z + [0.0, off]
        both(U[:1], wrong, LANDMARKS[:1])
        both(U[:1], wrong, LANDMARKS[:1], wrap=False)
