"""The search for misprints: which slips it tries, what it finds in the thesis, and whom it does not accuse."""

import numpy as np
import pytest

from labkit.calibration import hand_eye
from labkit.documents import misprints
from labkit.documents.thesis import printed as thesis
from labkit.geometry import frames


def test_slips_of_a_short_number():
    slips = misprints.single_slips("-1.2")
    assert slips["1.2"] == "sign lost"
    assert slips["-2.1"] == "two digits swapped"
    assert slips["-1.7"] == "one digit wrong"
    assert slips["-1."] == "one digit too many"
    assert slips["-1.25"] == "one digit missing"
    assert slips["-0.12"] == "decimal point moved"
    assert "-1.2" not in slips
    with pytest.raises(ValueError, match="plain decimal number"):
        misprints.single_slips("1e5")


def test_the_search_finds_the_seven_and_the_right_slip_first():
    found = misprints.find(thesis.printed_entries())
    assert sorted(found) == [row["pose"] for row in thesis.corrections()]
    for row in thesis.corrections():
        named = [(e.table, e.column, float(e.corrected)) for e in found[row["pose"]]]
        assert (row["table"], row["column"], float(row["corrected"])) in named
        first = found[row["pose"]][0]
        assert (first.column, float(first.corrected)) == (row["column"], float(row["corrected"]))
    assert {e.column for e in found[12][:2]} == {"A_deg", "C_deg"}  # only A - C counts: the two cannot be told apart


def test_corrected_tables_hold_no_suspects():
    entries = thesis.printed_entries()
    entries.update({(r["table"], r["pose"], r["column"]): r["corrected"] for r in thesis.corrections()})
    assert misprints.find(entries) == {}


def test_a_planted_slip_is_found():
    entries = thesis.printed_entries()
    entries.update({(r["table"], r["pose"], r["column"]): r["corrected"] for r in thesis.corrections()})
    right, entries["C14", 18, "y"] = entries["C14", 18, "y"], "-265.89"
    found = misprints.find(entries)
    assert list(found) == [18]
    assert (found[18][0].column, found[18][0].corrected, found[18][0].slip) == ("y", right, "two digits swapped")


def test_neighbors_speak_without_any_calibration():
    turns = np.rad2deg(misprints.neighbor_turns(thesis.measurements()))
    assert np.flatnonzero(turns > 0.8).tolist() == [11, 19, 20, 21]  # pose 12, and pose 21 with both neighbors
    assert turns[11] == pytest.approx(1.0, abs=0.03)
    offsets = misprints.neighbor_offsets(thesis.measurements())
    assert np.flatnonzero(np.abs(offsets) > 7).tolist() == [2, 6, 29]
    assert np.nanmax(np.rad2deg(misprints.neighbor_turns(thesis.measurements(True)))) < 0.15


def test_a_sensor_that_sees_nothing_wrong_is_not_accused():
    measured = thesis.measurements(True)
    fit = hand_eye.calibrate_sphere_target(measured.T_BF, measured.x_S)
    x_S = frames.transform(frames.invert(fit.T_FS), frames.transform(frames.invert(measured.T_BF), fit.target))
    x_S = x_S + 0.3 * np.random.default_rng(0).normal(size=x_S.shape)
    robust = hand_eye.calibrate_sphere_target(measured.T_BF, x_S, robust=True)
    assert (np.linalg.norm(robust.residuals, axis=1) < misprints.SUSPICIOUS * robust.std).all()
