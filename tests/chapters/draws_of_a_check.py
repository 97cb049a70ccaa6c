"""All that one check draws, and whether an answer is right on it: quicker than a check, which looks for words too."""

import copy
import os

import numpy as np

SEEDS = range(int(os.environ.get("LABKIT_SEEDS", "1")))  # of each check: what is special stands in every one


def one_check(item, seed=0):
    """(arguments, metric, right result) of all draws of one check."""
    rng = np.random.default_rng(seed)
    drawn = [(draw(rng), metric) for draw, metric, _ in item._plan()]
    return [(args, metric, item.reference(*copy.deepcopy(args))) for args, metric in drawn]


def is_missed(answer, args, metric, expected):
    """Whether an answer is not right on one draw."""
    try:
        return not metric.equal(metric.admit(answer(*copy.deepcopy(args)), expected), expected)
    except Exception:  # a result that the metric refuses, or none at all
        return True
