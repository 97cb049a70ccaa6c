"""Chapter 0's figure and its table of colors."""

import numpy as np
import pytest

from labkit.chapters.ch00_start_here import stages
from labkit.chapters.ch00_start_here.exercises import quarter_turn


def test_two_quarter_turns_are_what_the_exercise_says():
    p = np.array([3.0, 1.0])
    points = stages.compute({"p": p, "angle": 90})
    np.testing.assert_allclose(points, [p, quarter_turn(p), -p], atol=1e-15)


def test_the_point_stays_where_its_turns_are_in_the_picture():
    stage = stages.quarter_turns()
    stage.set(p=(6, 4))
    assert np.hypot(*stage.state["p"]) == pytest.approx(stages.RADIUS)
    stage.set(p=(0, 0))
    assert "nothing to turn" in stage.caption
    stage.make_it_fail()
    short = np.rad2deg(np.arccos(-stage.result[0] @ stage.result[2] / (stage.result[0] @ stage.result[0])))
    assert short == pytest.approx(20.0) and "20 deg" in stage.caption


def test_colors_are_told_in_words_as_well():
    bundle = stages.colors()._repr_mimebundle_()
    assert "prediction" in bundle["text/plain"] and "dashed line" in bundle["text/plain"]
    assert bundle["text/html"].count("<svg") == len(stages.ROLES)
