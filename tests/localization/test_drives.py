"""Routes and drives: the shortest way, free space, what odometry reports."""

import numpy as np
import pytest

from labkit.documents.lecture.examples import load_building
from labkit.documents.lecture.printed import example_noise
from labkit.localization import maps, odometry
from labkit.localization.drives import find_route, random_drive


@pytest.fixture(scope="module")
def building():
    return load_building()


def test_route_and_drive_stay_in_free_space(building):
    assert find_route(building.edges, "office A", "store") == [
        "office A", "door A", "corridor west", "door store", "store",
    ]  # fmt: skip
    drive = random_drive(building, example_noise(), 200, np.random.default_rng(16))
    assert drive.truth.shape == (201, 3) and drive.controls.shape == (200, 2)
    assert (building.grid.at(drive.truth[:, :2]) == maps.FREE).all()
    reckoned = odometry.drive(drive.truth[0], drive.controls, drive.dt)
    assert np.hypot(*(reckoned - drive.truth)[-1, :2]) > 0.3  # odometry alone drifts


def test_places_that_nothing_connects_are_refused():
    with pytest.raises(ValueError, match="no chain of edges"):
        find_route([("a", "b")], "a", "c")
