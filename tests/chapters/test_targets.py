"""Targets of the course's Stages: none is reached by the start or by "Make it fail", each can be reached."""

import importlib

import pytest

REACHED = {  # the Stages that declare a target, and changes that reach it
    "ch02_chaining.growth": {"n": 32, "std_rot_deg": 0.02},
    "ch02_chaining.two_loops": {"A": (-120.0, 0.0), "B": (430.0, 300.0)},
    "ch05_hand_eye.difference_steps": {"h": 1e-3},
    "ch08_kalman.vehicle": {"std_z": 0.5},
    "ch09_monte_carlo.map_forms": {"probe": (8.4, 2.1)},
}


@pytest.mark.parametrize("name", REACHED)
def test_a_target_waits_for_a_hand(name):
    room, function = name.split(".")
    stage = getattr(importlib.import_module(f"labkit.chapters.{room}.stages"), function)()
    assert "Target: " in stage.caption
    stage.make_it_fail()
    assert not stage.reached
    stage.reset()
    stage.set(**REACHED[name])
    assert stage.reached and "Target reached: " in stage.caption and not stage.status
