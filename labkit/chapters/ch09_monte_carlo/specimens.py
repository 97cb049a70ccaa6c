"""Four specimens for the bug hunt of chapter 9: each has a defect that published code really had, rewritten here.

The point is not who made them. All four pass a quick look, and none of them raises an error on friendly input.
"""

import numpy as np


def specimen_1(weights, rng):
    """Indices drawn by the roulette wheel: each spin takes the interval end nearest to it."""
    ends = np.cumsum(weights / weights.sum())
    spins = rng.random(len(weights))
    return np.searchsorted((ends[:-1] + ends[1:]) / 2, spins)


def specimen_2(weights, rng):
    """Indices by whole shares first: floor(M w) copies of each particle, the rest by roulette on what is left over."""
    share = weights / weights.sum()
    copies = np.floor(len(weights) * share).astype(int)
    left_over = share - copies
    ends = np.cumsum(left_over / left_over.sum())
    drawn = np.searchsorted(ends, rng.random(len(weights) - copies.sum()))
    return np.concatenate([np.repeat(np.arange(len(weights)), copies), drawn])


def specimen_3(weights, rng):
    """Indices by the spoke wheel: walk along the weights until the spoke is reached."""
    ends, spokes = np.cumsum(weights), (np.arange(len(weights)) + rng.random()) / len(weights)
    index, i = [], 0
    for spoke in spokes:
        while spoke > ends[i]:
            i += 1
        index.append(i)
    return np.array(index)


def specimen_4(states, ranges, landmarks, std):
    """Weights (M,) of states (M, 3) by measured ranges (m,) to landmarks (m, 2)."""
    weight = np.zeros(len(states))
    for r, mark in zip(ranges, landmarks):
        misfit = (r - np.hypot(*(mark - states[:, :2]).T)) / std
        weight += np.exp(-0.5 * misfit**2)
    return weight / weight.sum()
