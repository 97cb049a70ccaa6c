"""Gauss-Newton against trust region on the simulation model: closed forms, SciPy, and the printed counts."""

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from labkit.documents import ledger
from labkit.documents.thesis import comparison
from labkit.documents.thesis import printed as thesis
from labkit.geometry import frames

FAR = comparison.start_at(70.0, 175.0, B_deg=-88.0)


def aligned(B_deg):
    """The scanner's pose that Kabsch's closed form finds from the model's centers."""
    T_BF, x_S, target, _ = comparison.model(B_deg)
    seen = frames.transform(frames.invert(T_BF), target)
    R = Rotation.align_vectors(seen - seen.mean(0), x_S - x_S.mean(0))[0].as_matrix()
    return frames.pose(R, seen.mean(0) - R @ x_S.mean(0))


@pytest.mark.parametrize("B_deg", [-90.0, -88.0, -30.0])
@pytest.mark.parametrize("method", comparison.METHODS)
@pytest.mark.parametrize("parameters", comparison.PARAMETERS)
def test_both_methods_end_at_kabschs_pose(method, parameters, B_deg):
    found = comparison.run(method, comparison.start_at(60.0, 40.0, B_deg), parameters, B_deg=B_deg)
    assert found.arrived and found.poses[-1] == pytest.approx(aligned(B_deg), abs=1e-6)
    assert np.isfinite(found.rms).all() and len(found.poses) == len(found.rms) == len(found.accepted) + 1


def test_scipys_trust_region_arrives_from_all_ten_starts_as_well():
    T_BF, x_S, target, _ = comparison.model()
    runs = comparison.table_7_3()
    for start, newton, trust in zip(thesis.start_poses_deg()[0], *runs.values()):
        assert newton.arrived and trust.arrived

        def residuals(p):
            R = Rotation.from_euler("ZYX", p[3:]).as_matrix()
            seen = T_BF[:, :3, :3] @ (R @ x_S.T + p[:3, None]).T[..., None]
            return (seen[..., 0] + T_BF[:, :3, 3] - target).ravel()

        peer = least_squares(residuals, frames.kuka_from_degrees(start), method="trf", xtol=1e-15, ftol=1e-15)
        assert np.sqrt(2 * peer.cost / len(x_S)) < comparison.ARRIVED_MM


def test_a_shift_is_one_step_for_gauss_newton_and_a_walk_for_the_trust_region():
    runs = comparison.table_7_3()
    for k in (1, 2, 3):
        assert runs["Gauss-Newton"][k].steps == 1
        shift = comparison.errors(runs["trust region"][k].poses)[0, 0]
        least = int(np.ceil(np.log2(shift / 10.0 + 1)))  # radii 10, 20, 40, ...
        assert runs["trust region"][k].steps >= least
    assert all(run.climbs == run.taken_back == 0 for runs_of in runs.values() for run in runs_of)


def test_far_away_gauss_newton_climbs_and_the_trust_region_does_not():
    newton, trust = (comparison.run(method, FAR, B_deg=-88.0) for method in comparison.METHODS)
    assert (np.diff(newton.rms[: newton.steps + 1]) > 0).sum() == newton.climbs >= 2
    assert trust.climbs == 0 and (np.diff(trust.rms) <= 0).all()
    assert newton.arrived and trust.arrived and newton.steps > 2 * trust.steps


def test_a_small_radius_only_costs_steps():
    steps = [comparison.run("trust region", FAR, radius=r, B_deg=-88.0).steps for r in (0.01, 1.0, 30.0)]
    assert steps[0] > steps[1] > steps[2]


def test_a_start_is_where_it_was_asked_for():
    start = frames.matrix_from_kuka(frames.kuka_from_degrees(comparison.start_at(33.0, 170.0, -88.0)))
    assert comparison.errors(start, -88.0) == pytest.approx([33.0, 170.0], abs=1e-6)


def test_printed_counts_are_those_of_the_ledger_and_lead_to_the_printed_ratings():
    counts = thesis.iterations_7_3()
    for name, method in (("gn", "Gauss-Newton"), ("tr", "trust region")):
        rows = {r.id: r.printed for r in ledger.rows() if r.id.startswith(f"handeye.{name}_iterations")}
        for key, printed in rows.items():
            assert counts[method][int(key.split("[")[1][:-1])] == float(printed)
        assert np.isfinite(counts[method]).sum() == len(rows)
    assert comparison.rating(np.isfinite(counts["Gauss-Newton"])) == "very good"
    assert comparison.rating(np.isfinite(counts["trust region"])) == "good"
    assert comparison.rating([True, False]) == "bad"


def test_the_footnote_changes_the_eighth_start_alone():
    changed = thesis.footnote_start_deg() - thesis.start_poses_deg()[0][8]
    assert changed == pytest.approx([0, 0, 0, -0.004, 0, -0.004])
    below = [comparison.start_cost(s) < 1e-6 for s in thesis.start_poses_deg()[0]]
    assert np.flatnonzero(below).tolist() == [0, 4, 6]  # the toolbox's function tolerance


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: comparison.run("Newton", FAR), "method must be one of"),
        (lambda: comparison.run("trust region", FAR, "quaternion"), "parameters one of"),
        (lambda: comparison.run("trust region", FAR, radius=-1.0), "radius"),
        (lambda: comparison.run("trust region", FAR[:5]), "start_deg"),
    ],
)
def test_what_does_not_fit_is_refused(call, words):
    with pytest.raises(ValueError, match=words):
        call()
