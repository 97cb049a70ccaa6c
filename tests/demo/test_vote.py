"""A vote: hidden while it is open, one answer a device and round, two rounds, a table without devices."""

import csv
import io

import numpy as np
import pytest

from labkit.demo.program import Asked
from labkit.demo.vote import MAX_DEVICES, Refused, Votes

WORDS = Asked("Which?", ("a", "b", "c"), "b")
NUMBER = Asked("How far (mm)?", (), 11.2, unit="mm")


def test_the_distribution_is_hidden_until_the_vote_is_closed():
    votes = Votes()
    votes.open("k", WORDS)
    for device, answer in [("x", 0), ("y", 1), ("z", 1)]:
        votes.cast(device, "k", 1, answer)
    hidden = votes.ballot.shown()
    assert (hidden["counts"], hidden["shares"], hidden["open"]) == ([3], [], True)
    votes.close()
    assert votes.ballot.shown()["shares"] == [[1, 2, 0]]


def test_both_rounds_stand_side_by_side_and_there_is_no_third():
    votes = Votes()
    for number, answers in [(1, (0, 0, 1)), (2, (1, 1, 1))]:
        votes.open("k", WORDS)
        for device, answer in enumerate(answers):
            votes.cast(str(device), "k", number, answer)
        assert votes.ballot.shown()["shares"] == [[2, 1, 0]][: number - 1]  # the first is still shown
        votes.close()
    assert votes.ballot.shown()["shares"] == [[2, 1, 0], [0, 3, 0]]
    with pytest.raises(Refused, match="Both rounds"):
        votes.open("k", WORDS)


def test_a_device_counts_once_a_round_with_its_last_answer():
    votes = Votes()
    votes.open("k", WORDS)
    for answer in (0, 1, 2):
        votes.cast("x", "k", 1, answer)
    assert votes.seen_by("x")["mine"] == 2 and votes.seen_by("y")["mine"] is None
    votes.close()
    assert votes.ballot.shown()["shares"] == [[0, 0, 1]]


def test_only_the_open_round_of_the_question_shown_counts():
    votes = Votes()
    with pytest.raises(Refused, match="closed"):
        votes.cast("x", "k", 1, 0)
    votes.open("k", WORDS)
    votes.close()
    with pytest.raises(Refused, match="closed"):
        votes.cast("x", "k", 1, 0)
    votes.open("k", WORDS)
    with pytest.raises(Refused, match="closed"):
        votes.cast("x", "k", 1, 0)  # of the first round, too late
    votes.open("other", NUMBER)  # closes the one before
    with pytest.raises(Refused, match="closed"):
        votes.cast("x", "k", 2, 0)
    votes.cast("x", "other", 1, "3")
    assert not votes.ballots["k"].open


@pytest.mark.parametrize("answer", [3, -1, "0", 1.0, True, None, [0], {"a": 1}])
def test_what_is_no_choice_does_not_count(answer):
    votes = Votes()
    votes.open("k", WORDS)
    with pytest.raises(Refused, match="none of the choices"):
        votes.cast("x", "k", 1, answer)
    assert votes.ballot.shown()["counts"] == [0]


@pytest.mark.parametrize("answer, value", [("12.5", 12.5), (" 12,5 ", 12.5), ("−3", -3.0), (7, 7.0), ("1e3", 1000.0)])
def test_numbers_are_read_as_phones_write_them(answer, value):
    votes = Votes()
    votes.open("k", NUMBER)
    votes.cast("x", "k", 1, answer)
    assert votes.seen_by("x")["mine"] == value


@pytest.mark.parametrize("answer", ["", "ten", "nan", "inf", "1e300", None, "1" * 1000, [1], "0x10"])
def test_what_is_no_number_does_not_count(answer):
    votes = Votes()
    votes.open("k", NUMBER)
    with pytest.raises(Refused, match="A number"):
        votes.cast("x", "k", 1, answer)


@pytest.mark.parametrize("seed", range(20))
def test_every_number_falls_into_one_bin(seed):
    """Oracle: the counts add up, and few bins hold them, outliers and equal values included."""
    rng = np.random.default_rng(seed)
    values = [rng.normal(11, 3, 80), rng.integers(0, 3, 30), 10.0 ** rng.uniform(-3, 9, 50), np.full(5, 7.0), [0.0]]
    votes = Votes()
    votes.open("k", NUMBER)
    chosen = values[seed % 5]
    for device, value in enumerate(chosen):
        votes.cast(str(device), "k", 1, float(value))
    votes.close()
    shown = votes.ballot.shown()
    assert sum(shown["shares"][0]) == len(chosen)
    assert len(shown["labels"]) == len(shown["shares"][0]) <= 9


def test_bins_are_where_the_labels_say():
    votes = Votes()
    votes.open("k", NUMBER)
    for device, value in enumerate([0.5, 1.5, 1.6, 2.5, 4.5, 5.5]):
        votes.cast(str(device), "k", 1, value)
    votes.close()
    shown = dict(zip(votes.ballot.shown()["labels"], votes.ballot.shown()["shares"][0]))
    assert shown == {"0 to 1": 1, "1 to 2": 2, "2 to 3": 1, "3 to 4": 0, "4 to 5": 1, "5 to 6": 1}


def test_no_more_devices_than_a_lecture_hall_has():
    votes = Votes()
    votes.open("k", WORDS)
    for device in range(MAX_DEVICES):
        votes.cast(str(device), "k", 1, 0)
    with pytest.raises(Refused, match=str(MAX_DEVICES)):
        votes.cast("one more", "k", 1, 0)
    votes.cast("0", "k", 1, 1)  # whoever has voted may change it


def test_the_table_holds_closed_rounds_and_no_device():
    votes = Votes()
    votes.open("k", WORDS)
    votes.cast("secret", "k", 1, 1)
    votes.open("n", NUMBER)
    for device, value in enumerate([11.0, 11.0, 30.0]):
        votes.cast(str(device), "n", 1, value)
    votes.close()
    votes.open("k", WORDS)
    votes.cast("secret", "k", 2, 0)
    rows = list(csv.reader(io.StringIO(votes.csv())))
    assert rows == [
        ["key", "question", "round", "answer", "right", "votes"],
        ["k", "Which?", "1", "a", "no", "0"],
        ["k", "Which?", "1", "b", "yes", "1"],
        ["k", "Which?", "1", "c", "no", "0"],
        ["n", "How far (mm)?", "1", "11.0", "yes", "2"],
        ["n", "How far (mm)?", "1", "30.0", "no", "1"],
    ]
    assert "secret" not in votes.csv()


def test_no_cell_of_the_table_is_a_formula():
    votes = Votes()
    votes.open("k", Asked("=1+1", ("+a", "b"), None))
    votes.close()
    assert list(csv.reader(io.StringIO(votes.csv())))[1][1:5] == ["'=1+1", "1", "'+a", ""]
