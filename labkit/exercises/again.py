"""Draws that are the same at every check, on which an explanation is tried once more."""

import copy

import numpy as np


class Again:
    """Arguments and what is expected of them, by number: each is made once, and what is handed out is a copy.

    draws: endless iterable of (draw, what goes with it). reference: function of the arguments.
    """

    def __init__(self, draws, reference):
        self._draws, self._reference = iter(draws), reference
        self._rng, self._made = np.random.default_rng(0), []

    def __getitem__(self, number):
        """(arguments, expected result, what goes with the draw)."""
        while len(self._made) <= number:
            draw, beside = next(self._draws)
            args = draw(self._rng)
            self._made.append((args, self._reference(*copy.deepcopy(args)), beside))
        args, expected, beside = self._made[number]
        return copy.deepcopy(args), copy.deepcopy(expected), beside
