"""Chapter 4's Stages without a browser: what they compute, and that every preset and control gives a picture."""

import numpy as np
import pytest

from labkit.chapters.ch04_optimization import stages
from labkit.documents.thesis import wells
from labkit.estimation import optimization as opt

FUNCTIONS = (stages.line, stages.four_paths, stages.saddle, stages.convexity, stages.basins)


@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda f: f.__name__)
def test_presets_change_the_picture_and_reset_brings_it_back(function):
    stage = function()
    first, text = stage.png(), repr(stage)
    stage.press("Make it fail")
    assert stage.status == "" and stage.png() != first
    stage.press("Reset")
    assert stage.status == "" and stage.png() == first
    assert repr(stage) == text and text.startswith("[stage: ")


def test_walk_on_the_line_is_newton_in_one_dimension():
    t = 0.35
    result = stages.walk({"start": np.array([t, 0.0])})
    h = 1e-4
    f = [wells.value(wells.on_line(t + k * h)) for k in (-1, 0, 1)]
    slope, bend = (f[2] - f[0]) / (2 * h), (f[2] - 2 * f[1] + f[0]) / h**2
    assert result["bend"] == pytest.approx(bend, rel=1e-5)
    assert result["vertex"] == pytest.approx(t - slope / bend, rel=1e-6) == pytest.approx(result["t"][1], abs=1e-6)
    assert result["end"] == "saddle" and stages.walk({"start": np.array([0.84, 0.0])})["end"] == "nowhere"


def test_the_handle_stays_on_the_curve():
    stage = stages.line()
    stage.set(start=(0.9, 0.0))
    assert stage.state["start"][1] == pytest.approx(wells.value(wells.on_line(0.9)))


@pytest.mark.parametrize("method", wells.METHODS)
def test_four_paths_show_the_step_of_every_iteration(method):
    state = {"start": np.array([2.0, -1.0]), "method": method}
    run = wells.run(method, state["start"], max_iterations=stages.SHOWN)
    for k in (0, 3, stages.SHOWN - 1):
        result = stages.four_runs({**state, "k": k})
        shown = min(k, run.iterations - 1)
        assert result["k"] == shown
        np.testing.assert_allclose(result["step"], run.step[shown])
        x, (f, g, B) = result["x"], wells.model(method, result["x"])
        assert f == pytest.approx(wells.value(x))
        np.testing.assert_allclose(g, wells.gradient(x), atol=1e-9)
        if method == "newton":
            np.testing.assert_allclose(result["step"], opt.newton_step(g, B))


def test_model_contours_lie_on_levels_of_the_model():
    x = np.array([0.5, -0.4])
    f, g, B = wells.model("newton", x)
    lines = stages.model_contours(x, (f, g, B), 0.5)
    pieces = np.split(lines, np.flatnonzero(np.isnan(lines[:, 0])))
    for piece in pieces:
        h = piece[~np.isnan(piece[:, 0])] - x
        assert np.ptp(f - opt.predicted_decrease(g, B, h)) < 0.05 if len(h) else True


def test_the_prediction_of_four_paths_comes_true():
    ends = stages.four_runs({"start": np.array([3.0, 3.0]), "method": "newton", "k": 0})["ends"]
    assert list(ends.values()).count("global minimum") == 1


def test_newton_step_near_the_saddle_is_the_sum_of_its_shares():
    result = stages.near_saddle({"start": np.array([0.6, 0.2]), "method": "newton"})
    np.testing.assert_allclose(result["shares"].sum(axis=1), result["run"].step[0])
    assert result["climb"] > 0 and result["end"] == "saddle"
    assert stages.near_saddle({"start": np.array([0.6, 0.2]), "method": "trust_region"})["end"] == "local minimum"


def test_rubbing_uncovers_what_the_brush_touched_and_nothing_else():
    stage = stages.basins()
    assert stage.result["covered"].all()
    covered = stages.rub({"memory": np.ones((121, 121), dtype=bool), "brush": np.array([[0.0, 0.0]])}, "brush")
    rows, columns = np.nonzero(~covered)
    places = np.linspace(-6, 6, 121)
    assert np.hypot(places[rows], places[columns]).max() <= stages.BRUSH + 1e-9
    assert len(rows) == pytest.approx(np.pi * (stages.BRUSH / 0.1) ** 2, rel=0.1)
    stroke = {"memory": np.ones((121, 121), dtype=bool), "brush": np.array([[-5.9, 0.0], [5.9, 0.0]])}
    assert not stages.rub(stroke, "brush")[60].any()
    stage.set(all=True)
    assert not stage.result["covered"].any()
    assert stage.result["shares"][:2].sum() < 0.01 < stage.result["shares"][2]  # the prediction "share"
    stage.set(method="trust_region")
    assert stage.result["shares"][:2].sum() == 1


@pytest.mark.parametrize("method", wells.METHODS)
def test_no_sentence_of_a_caption_begins_in_lower_case(method):
    near = stages.saddle()
    near.set(method=method) if method in ("newton", "trust_region") else None
    basins = stages.basins()
    basins.set(method=method, all=True)
    for stage in (stages.line(), near, stages.four_paths(), basins):
        assert not any(sentence[0].islower() for sentence in stage.caption.split(". ")), stage.caption


def test_the_first_prediction_comes_true():
    result = stages.walk({"start": np.array([0.2, 0.0])})
    assert result["bend"] < 0 and result["end"] == "saddle"


def test_a_chord_between_the_wells_lies_below_f_though_both_ends_are_convex():
    L, G, _ = (e.x for e in wells.extrema())
    result = stages.chord_between({"P": L, "Q": G, "matrix": "H"})
    assert result["positive"][0] and result["positive"][-1] and not result["positive"].all()
    top = max(wells.value((1 - t) * L + t * G) - (1 - t) * wells.value(L) - t * wells.value(G) for t in result["share"])
    assert result["rise"] == pytest.approx(top) and 85 < top < 95
    assert stages.chord_between({"P": L, "Q": G, "matrix": "J"})["positive"].all()


def test_where_the_hessian_is_positive_definite_no_chord_is_crossed():
    rng, inside = np.random.default_rng(0), 0
    for P, Q in wells.CENTERS[0] + rng.uniform(-0.7, 0.7, (40, 2, 2)):
        result = stages.chord_between({"P": P, "Q": Q, "matrix": "H"})
        inside += result["positive"].all()
        assert result["rise"] < 1e-9 or not result["positive"].all()
    assert 5 < inside < 35


def test_the_target_of_four_paths_is_near_a_minimum_and_not_at_a_saddle():
    stage = stages.four_paths()
    stage.set(start=wells.extrema()[1].x + 0.05)
    assert stage.reached and set(stage.result["ends"].values()) == {"global minimum"}
    stage.set(start=wells.extrema()[2].x)
    assert not stage.reached and stage.status == ""


def test_a_start_without_slope_is_said_to_be_one(monkeypatch):
    """Whether the gradient is exactly 0 at a stationary point, hangs on rounding: here it is."""
    flat = lambda of: lambda x, **options: 0 * of(x, **options)  # noqa: E731
    monkeypatch.setattr(wells, "gradient", flat(wells.gradient))
    stages._runs.cache_clear()
    result = stages.four_runs({"start": np.array([0.5, 0.5]), "method": "trust_region", "k": 3})
    stages._runs.cache_clear()
    assert result["runs"]["trust_region"].iterations == 0
    assert not result["step"].any() and result["k"] == 0
    assert stages._four_caption(result).endswith("Trust region takes no step: there is no slope at its start.")
