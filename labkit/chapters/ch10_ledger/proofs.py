"""Chapter 10: two exercises, a rounding bound to propagate and a column of numbers with one slip in it."""

import functools
import itertools
import statistics

import numpy as np

from ...documents.rounding import half_unit, number, propagate, read
from ...documents.slips import explained_by, single_slips
from ...exercises import metrics
from ...exercises.engine import Exercise
from ...exercises.outcome import Mistake

# --- propagate a bound ---


def total(x):
    """The sum of all."""
    return float(x.sum())


def product(x):
    """The product of all."""
    return float(x.prod())


def length(x):
    """The length of the vector."""
    return float(np.sqrt((x**2).sum()))


def share(x):
    """The first over the sum of all."""
    return float(x[0] / np.sum(x))


def last_power(x):
    """The first times the square of the last, less the second."""
    return float(x[0] * x[-1] ** 2 - x[1])


def depth(x):
    """How far the vector reaches below 1: greatest, and flat, where all are 0, and falling with each square."""
    return float(1 - np.sum(np.square(x)))


def shortage(x):
    """Ten less the product of the first and the square of the last."""
    return float(10 - x[0] * x[-1] ** 2)


def growth(x):
    """The power of 1.2 by the sum of all, which grows the faster the larger they are."""
    return float(1.2 ** np.sum(x))


FUNCTIONS = (total, product, length, share, last_power, depth, shortage)


def printed_inputs(rng, function):
    """A function and two to four printed numbers; at least one of them is coarse, so that up and down differ."""
    texts = [f"{rng.uniform(2, 9):.{rng.integers(0, 4)}f}" for _ in range(rng.integers(1, 4))]
    texts.append(f"{rng.uniform(2, 9):.{rng.integers(0, 2)}f}")
    texts = [("-" if rng.random() < 0.3 and function is not share else "") + text for text in texts]
    return function, [
        str(text).replace(".", ",") if rng.random() < 0.2 else str(text) for text in rng.permutation(texts)
    ]


INPUTS = tuple(functools.partial(printed_inputs, function=f) for f in FUNCTIONS)


def special_inputs(rng, kind):
    """A function and printed numbers: "whole", with an "exponent", one printed "twice", "one" alone, "nine", or with a
    "zero" among them, or zeros "only"; "fine" and "large": all of six decimals and near 0, or in the ten thousands;
    "negative": all below 0.
    """
    if kind == "only":
        return total, ["0", "0.0", "-0,00"][: rng.integers(2, 4)]
    texts = [str(rng.integers(2, 30)) for _ in range({"one": 1, "nine": 9}.get(kind, 3))]
    if kind == "exponent":
        texts[0] = f"{rng.uniform(2, 9):.{rng.integers(1, 3)}f}e{rng.choice([-2, -1])}"
        texts[1] = f"{rng.uniform(2, 9):.{rng.integers(1, 3)}f}e{rng.choice([3, 4])}".replace(".", ",")
    elif kind == "negative":
        texts = [f"-{rng.uniform(1, 3):.{rng.integers(0, 2)}f}" for _ in texts]
    elif kind == "fine":
        texts = [f"{rng.uniform(-2e-4, 9e-4):.6f}" for _ in texts]
    elif kind == "large":
        texts = [f"{rng.uniform(1e4, 9e4):.{rng.integers(0, 3)}f}" for _ in texts]
    elif kind == "zero":
        texts[int(rng.integers(0, 3))] = str(rng.choice(["0", "0.0", "-0,00"]))
    elif kind == "twice":
        texts = [f"{rng.uniform(2, 9):.{rng.integers(1, 3)}f}" for _ in range(2)]
        texts.insert(int(rng.integers(0, 3)), texts[0])
    return {"one": length, "nine": length, "large": length, "fine": total, "negative": growth}.get(
        kind, last_power
    ), texts


def bound(f, printed):
    """How far rounding of the printed inputs can move f, to first order."""
    return float(propagate(f, read(printed))[1])


def _moves(f, printed, halves=half_unit):
    """What f gains when each number goes up, and when each goes down, by its half unit; two lists."""
    x = np.array([number(text) for text in printed])
    steps = [halves(text) * np.eye(len(x))[k] for k, text in enumerate(printed)]
    return [f(x + step) - f(x) for step in steps], [f(x - step) - f(x) for step in steps]


def _larger(f, printed, halves=half_unit):
    return np.abs(_moves(f, printed, halves)).max(axis=0)


def _larger_with_signs(f, printed):
    up, down = map(np.array, _moves(f, printed))
    return np.where(np.abs(up) >= np.abs(down), up, down)


def _all_at_once(f, printed):
    x, halves = read(printed)
    return max(abs(f(x + halves) - f(x)), abs(f(x - halves) - f(x)))


def _corners(f, printed):
    x, halves = read(printed)
    signs = itertools.product((-1, 1), repeat=len(x))
    return max(abs(f(x + halves * np.array(corner)) - f(x)) for corner in signs)


def _never_put_back(f, printed):
    x, halves = read(printed)
    moved, found = x.copy(), 0.0
    for k, half in enumerate(halves):
        moved[k] += half
        found += abs(f(moved) - f(x))
    return found


def _moved_on(f, printed):
    """Each number goes up and down from where those before it went up, and is compared with f there."""
    x, halves = read(printed)
    found = 0.0
    for step in halves * np.eye(len(x)):
        found += max(abs(f(x + step) - f(x)), abs(f(x - step) - f(x)))
        x = x + step
    return found


def _larger_both_ways(f, printed):
    """The larger of what f gains where each number goes up, and of what it gains on the way back from down."""
    up, down = map(np.array, _moves(f, printed))
    return np.where(np.abs(up) >= np.abs(down), up, -down)


def _up_and_left_down(f, printed):
    x, halves = read(printed)
    found = 0.0
    for k, half in enumerate(halves):
        up, down = x.copy(), x.copy()
        up[k] += half
        down[k] -= half
        found += max(abs(f(up) - f(read(printed).values)), abs(f(down) - f(read(printed).values)))
        x = down
    return found


def _through_float(text):
    return half_unit(str(number(text)))


def _by_derivative(step):
    """Half units times the slopes of f, by differences over steps of this size."""
    return lambda f, printed: (
        np.abs(np.subtract(*_moves(f, printed, lambda text: step)) / (2 * step)) @ read(printed)[1]
    )


def _by_forward_differences(step):
    """The same by differences from the value up."""
    return lambda f, printed: np.abs(_moves(f, printed, lambda text: step)[0]) / step @ read(printed)[1]


def _signs_left(f, printed):
    up, down = _moves(f, printed)
    return np.maximum(up, down).sum()


def _one_sign_left(f, printed):
    up, down = _moves(f, printed)
    return np.maximum(up, np.abs(down)).sum()


def _other_sign_left(f, printed):
    up, down = _moves(f, printed)
    return np.maximum(np.abs(up), down).sum()


def _relative_moves(f, printed):
    return _larger(f, printed, lambda text: half_unit(text) * abs(number(text))).sum()


def _one_half_for_all(pick):
    """All numbers moved by the same half unit, the one picked of the list."""

    def variant(f, printed):
        half = pick([half_unit(text) for text in printed])
        return _larger(f, printed, lambda text: half).sum()

    return variant


BOUND = Exercise(
    "bound",
    reference=bound,
    draw=INPUTS,
    metric=metrics.Numbers(1e-9),
    noisy=[
        (
            functools.partial(special_inputs, kind=kind),
            metrics.Numbers(1e-9, least=0.0 if kind == "fine" else 1.0),
            f"right on ordinary draws, but not where {words}:",
        )
        for kind, words in (
            ("whole", "all numbers are whole"),
            ("exponent", "a number is printed with an exponent, as 3e-4"),
            ("twice", "one and the same number is printed twice"),
            ("one", "f takes one number alone"),
            ("nine", "f takes more than four numbers"),
            ("zero", "a number is printed as 0: that may be anything within its half unit too"),
            ("negative", "all numbers are below 0"),
            ("fine", "all numbers are near 0, with six decimals: half units of half a millionth move f as well"),
            ("large", "all numbers are above 10000: they may be off by their half unit and no more"),
            ("only", "all numbers are printed as 0"),
        )
    ],
    hints=(
        "Move one number at a time by its half unit, up and down, and look at what f does.",
        "For each number: f with it half a unit up, and f with it half a unit down. The larger of the two changes "
        "counts; those of all numbers add up, as absolute values.",
        "`x = np.array([float(text.replace(',', '.')) for text in printed])\n"
        "found = 0.0\n"
        "for k, text in enumerate(printed):\n"
        "    step = half_unit(text) * np.eye(len(x))[k]\n"
        "    found += max(abs(f(x + step) - f(x)), abs(f(x - step) - f(x)))\n"
        "return found`",
    ),
    mistakes=[
        Mistake(
            lambda f, p: float(sum(map(half_unit, p))),
            "You added the half units themselves. What counts is how far each of them moves f.",
        ),
        Mistake(
            lambda f, p: _larger(f, p, lambda text: 2 * half_unit(text)).sum(),
            "You moved each number by a whole unit of its last digit. Rounding hides half of one.",
        ),
        Mistake(
            _all_at_once,
            "You moved all numbers at once: their moves may cancel. Move one at a time and add the absolute values.",
        ),
        Mistake(
            lambda f, p: max(np.abs(moves).sum() for moves in _moves(f, p)),
            "You add all ups and all downs and take the larger sum. For one number the way up may be longer, for "
            "another the way down: the larger of the two counts for each.",
        ),
        Mistake(
            _corners,
            "You move all numbers at once, in all combinations of up and down. Move one at a time, and add what each "
            "of them does.",
        ),
        Mistake(
            lambda f, p: _larger(f, p).max(),
            "That is the worst single number. All of them may be off at once: add the moves up.",
        ),
        Mistake(
            lambda f, p: np.sqrt((_larger(f, p) ** 2).sum()),
            "The root of the sum of squares is for random errors. A bound must hold in the worst case: add all moves.",
        ),
        Mistake(
            lambda f, p: np.sqrt((_larger(f, p) ** 2).sum() / 3),
            "A move over the root of 3, added as squares, is a standard deviation, of numbers that lie evenly within "
            "their half unit. A bound must hold in the worst case: add all moves.",
            id="bound-standard-deviation",
        ),
        Mistake(
            lambda f, p: abs(sum(_moves(f, p)[0])),
            "You added the moves with their signs, so that they cancel: take the absolute value of each first.",
        ),
        *(
            Mistake(
                lambda f, p, way=way: sum(_moves(f, p)[way]),
                "You added the moves of one direction with their signs, so that they cancel: take the absolute value "
                "of each first, and look at the other direction too.",
            )
            for way in (0, 1)
        ),
        Mistake(
            lambda f, p: abs(_larger_with_signs(f, p).sum()),
            "Of each number you took the larger move, but with its sign, so that they cancel in the sum: take the "
            "absolute value of each before you add.",
        ),
        Mistake(
            lambda f, p: abs(_larger_both_ways(f, p).sum()),
            "Of each number you took the larger move, but with a sign, so that they cancel in the sum: take the "
            "absolute value of each before you add.",
            id="bound-signs-both-ways",
        ),
        Mistake(
            lambda f, p: _larger(f, p)[:2].sum(),
            "You moved the first two numbers only. Each of them counts, however many there are.",
        ),
        Mistake(
            lambda f, p: np.abs(_moves(f, p)[0]).sum(),
            "You moved the numbers up only. Where f is curved the way down can be the longer one: the larger counts.",
        ),
        Mistake(
            lambda f, p: np.abs(_moves(f, p)[1]).sum(),
            "You moved the numbers down only. Where f is curved the way up can be the longer one: the larger counts.",
        ),
        Mistake(
            lambda f, p: np.abs(np.subtract(*_moves(f, p))).sum() / 2,
            "This is the mean of the two moves, or half of the way from down to up. What counts is how far f moves "
            "from its value, up and down: the larger of the two.",
            id="bound-fd3da6",
        ),
        Mistake(
            lambda f, p: np.abs(np.subtract(*_moves(f, p))).sum(),
            "These are both moves together, or the whole way from down to up. A bound says how far f can be from its "
            "value: the larger of the two.",
            id="bound-545cd3",
        ),
        Mistake(
            lambda f, p: np.minimum(*np.abs(_moves(f, p))).sum(),
            "Of the way up and the way down you took the shorter: a bound must hold for the longer one.",
        ),
        Mistake(
            lambda f, p: _larger(f, p).mean(),
            "That is the mean of the moves. All numbers may be off at once: add the moves up.",
        ),
        Mistake(
            lambda f, p: _larger(f, p)[read(p).values != 0].sum(),
            "A number that is printed as 0 does not move yet: it may be anything within its half unit as well.",
        ),
        Mistake(
            _up_and_left_down,
            "A number that went up and down stays down while the next one moves: put each back to where it was.",
        ),
        Mistake(
            _moved_on,
            "Each number stays moved up while the next one moves: put it back to where it was, and compare with f of "
            "the numbers as they are printed.",
            id="bound-moved-on",
        ),
        Mistake(
            _never_put_back,
            "The numbers you moved before stay moved: put each back before the next one goes.",
        ),
        Mistake(
            lambda f, p: _larger(f, p, _through_float).sum(),
            "float() forgets how many digits were printed. Take the half unit from the string.",
        ),
        Mistake(_signs_left, "You took the larger gain. A fall can be the larger change: compare absolute values."),
        *(
            Mistake(
                variant,
                "Of the two changes one is taken with its sign. A fall counts as much as a rise: both need abs().",
            )
            for variant in (_one_sign_left, _other_sign_left)
        ),
        *(
            Mistake(
                _by_derivative(step),
                "That is the slope times the half unit. Where f is curved the move itself is another: go the half "
                "unit up and down.",
                id=f"bound-1fcd90{which}",
                within=1e-5,  # slopes of one's own
            )
            for step, which in ((1e-6, ""), (1e-5, "-2"), (1e-4, "-3"), (1e-7, "-4"), (1e-8, "-5"))
        ),
        *(
            Mistake(
                _by_forward_differences(step),
                "That is the slope times the half unit. Where f is curved the move itself is another: go the half "
                "unit up and down.",
                id=f"bound-1fcd90{which}",
            )
            for step, which in ((1e-6, "-6"), (1e-7, "-7"), (1e-8, "-8"))
        ),
        Mistake(
            _relative_moves,
            "You took the half unit as a share of the number. It has the number's own unit: add and subtract it.",
        ),
        *(
            Mistake(
                _one_half_for_all(pick),
                "You move all numbers by the same half unit. Each was printed with digits of its own, and has its own.",
            )
            for pick in (lambda halves: halves[0], lambda halves: halves[-1], max, min)
        ),
        Mistake(
            lambda f, p: _larger(f, p).max() * len(p),
            "You took the largest move for every number. Each number moves f by its own amount: add these up.",
        ),
        Mistake(
            lambda f, p: bound(f, p) / abs(f(read(p).values)),
            "That is a share of the value. The bound has the unit of f.",
        ),
        Mistake(
            lambda f, p: bound(f, p) + f(read(p).values),
            "You added the value. Wanted is how far it can be off.",
        ),
    ],
    draws=3 * len(INPUTS),
)


# --- prove a misprint ---


FINE = {"fine": (0.3, 1), "too fine": (0.8, 1), "finest": (0.56, 2)}  # units it is off, digits an average has more
AWAY = {"edge": -1, "beyond": -2, "far": 2}  # units from the rounded average, to the side it was not rounded to


LIMIT = 0.04  # how near a gap at the limit is to what rounding allows, as a share of it
BEYOND = (1.3, 1.5)  # and one that is beyond, but within the largest half unit


def at_the_limit(rng, finer, low, high):
    """Entries of mixed digits and an average as far away as `low` to `high` times what their rounding allows.

    finer: how many decimals the average has more than the coarsest entry. Beyond 1, some slip must explain the gap;
    below, some slip would if a little less were allowed, so that whoever allows less names somebody.
    """
    while True:
        decimals, count = int(rng.integers(1, 3)), int(rng.integers(4, 6))
        digits = decimals + rng.permutation([0, 1, 1, *rng.integers(0, 2, count - 3)])
        entries = [f"{rng.uniform(2, 60) * rng.choice([-1, 1], p=[0.2, 0.8]):.{d}f}" for d in digits]
        own = 0.5 * 10.0 ** -(decimals + finer)
        allowed = sum(map(half_unit, entries)) / count + own
        mean = sum(map(number, entries)) / count
        average = f"{mean + rng.choice([-1, 1]) * allowed * rng.uniform(low, high):.{decimals + finer}f}"
        off = abs(mean - number(average)) / allowed
        if low < off < high and _suspected(_gaps(entries, average), -LIMIT if high < 1 else 0):
            return entries, average


def column(rng, slip):
    """Entries and their average as printed, with a slip in an entry, in the average, or nowhere.

    With a slip in an entry the average is printed to its last digit. "edge", "beyond" and "far" print an average that
    is 1 to 2, 3 to 4 and 4 to 5 half units away: entries and average together allow 2, each alone 1. "fine" prints it
    with one digit more, and off by what the entries alone allow; "too fine" and "finest" are off by more than that. In
    "mixed" one entry has a digit less than the others, and is what allows most. "alone" is one entry; "lost" are whole
    numbers of two digits, one of which had three.
    """
    if slip in ("alone", "lost"):
        return _of_few_digits(rng, slip == "lost")
    decimals, count = int(rng.integers(1, 4)), int(rng.integers(4, 6))
    values = np.round(rng.uniform(2, 60, count) * rng.choice([-1, 1], count, p=[0.2, 0.8]), decimals)
    unit, more = 10.0**-decimals, int(rng.integers(0, 2))
    if slip in AWAY:
        near = np.round(values.mean(), decimals)
        if not 0.05 * unit < abs(values.mean() - near) < 0.3 * unit:
            return column(rng, slip)
        side = 1 if values.mean() <= near else -1
        return [f"{value:.{decimals}f}" for value in values], f"{near + AWAY[slip] * side * unit:.{decimals}f}"
    entries, average = [f"{value:.{decimals}f}" for value in values], f"{values.mean():.{decimals + more}f}"
    if slip in FINE:
        off, more = FINE[slip]
        average = f"{values.mean() + off * unit * rng.choice([-1, 1]):.{decimals + more}f}"
    elif slip == "mixed":
        values[1] = np.round(values[1], decimals - 1)
        entries[1], average = f"{values[1]:.{decimals - 1}f}", f"{values.mean() + 0.8 * unit:.{decimals + 1}f}"
    elif slip == "average":
        average = _slipped(rng, average, "one digit wrong")
    elif slip:
        k, average = int(rng.integers(count)), f"{values.mean():.{decimals + 2}f}"
        entries[k] = _slipped(rng, entries[k], slip)
    return entries, average


def of_the_average_alone(rng):
    """A column whose average has a slip that no slip of an entry explains."""
    while True:
        entries, average = column(rng, "average")
        if _suspected(_gaps(entries, average), 0) == {len(entries)}:
            return entries, average


def explained_by_both(rng, counted):
    """A column in which a slip explains the gap by what the rounding of entries and average allows together, and not by
    that of the one of them which is counted, and printed with more digits than the other.
    """
    while True:
        decimals, finer = int(rng.integers(1, 3)), -1 if counted[0] else 2
        values = rng.uniform(2, 60, int(rng.integers(4, 6)))
        entries, average = [f"{value:.{decimals}f}" for value in values], f"{values.mean():.{decimals + finer}f}"
        k = int(rng.integers(len(entries)))
        entries[k] = _slipped(rng, entries[k], "one digit wrong")
        gaps = _gaps(entries, average)
        if _suspected(gaps, 0) != _suspected(gaps, 0, counted=counted):
            return entries, average


def _of_few_digits(rng, lost):
    """One entry and an average with two digits swapped; or whole numbers, of which one lost its first digit."""
    if lost:
        values = rng.integers(11, 60, 4)
        values[0] += values.sum() % 4 == 0  # the mean is not whole, so that it takes their half units to explain it
        return [str(value) for value in rng.permutation(values)], str(round(values.mean() + 25))
    tens, ones = rng.choice(np.arange(1, 10), 2, replace=False)
    return [f"{tens}{ones}.5"], f"{ones}{tens}.5"


def _slipped(rng, text, kind):
    """The number with one slip that moves it by more than a few units of its last digit."""
    far = [
        other
        for other, how in single_slips(text).items()
        if how == kind and abs(number(other) - number(text)) > 40 * half_unit(text)
    ]
    return str(rng.choice(far)) if far else f"{-number(text):.{len(text.partition('.')[2])}f}"


LEFT_OUT = {
    "one digit too many": "one digit missing",
    "decimal point moved": "decimal point moved",
}  # and what makes it


def of_one_kind(rng, kind):
    """A column in which somebody is suspected for a slip of this kind alone."""
    while True:
        values = np.round(rng.uniform(2, 60, 4), int(rng.integers(1, 3)))
        entries, k = [str(value) for value in values], int(rng.integers(4))
        average = f"{values.mean():.4f}"
        entries[k] = _slipped(rng, entries[k], LEFT_OUT[kind])
        if _search(slips=_without(kind))(entries, average) != suspects(entries, average):
            return entries, average


def _clear(rng, draw):
    """A column of which no gap, as it is or after a slip, lies at what is allowed to the last bits, be it by all, by
    the entries alone or by the average alone.

    Nor does it matter whether a number with a slip keeps its half unit or gets that of its new digits.
    """
    while True:
        drawn = draw(rng)
        gaps = _gaps(*drawn)
        if all(
            _suspected(gaps, -1e-7, False, counted) == _suspected(gaps, 1e-7, kept, counted)
            for kept, counted in ((False, (1, 1)), (True, (1, 1)), (False, (1, 0)), (False, (0, 1)))
        ):
            return drawn


def _gaps(entries, average):
    """The gap and what rounding of the entries and of the average allows, as printed; and of each number, after each of
    its slips, the gap and by how much more is allowed for the new digits.
    """
    printed = [*entries, average]
    part = np.append(np.full(len(entries), 1 / len(entries)), -1.0)  # of each number in the gap
    values, halves = _read(printed)
    gap, slips = part @ values, []
    for text, share, value, half in zip(printed, part, values, halves):
        others, own = _read(single_slips(text))
        slips.append((np.abs(gap + share * (others - value)), abs(share) * (own - half)))
    allowed = np.abs(part) * halves
    return abs(gap), (allowed[:-1].sum(), allowed[-1]), slips


def _read(texts):
    return np.array([number(text) for text in texts]), np.array([half_unit(text) for text in texts])


def _suspected(gaps, more, kept=False, counted=(1, 1)):
    """`suspects` from the gaps, where more than rounding explains is allowed, by this share of it.

    kept: a number with a slip keeps the half unit that it was printed with. counted: whether what rounding of the
    entries allows counts, and what that of the average does.
    """
    gap, allowed, slips = gaps
    allowed = np.dot(counted, allowed)
    if gap <= allowed * (1 + more):
        return set()
    counts = len(slips) * [0] if kept else [counted[0]] * (len(slips) - 1) + [counted[1]]
    return {k for k, (left, new) in enumerate(slips) if (left <= (allowed + counts[k] * new) * (1 + more)).any()}


def other_columns(rng, kind):
    """Columns with a slip at a place that `column` never has.

    "twice": an entry that is printed twice, and either of the two may be wrong. "beside": the same, and another one is
    wrong. "many": more entries than five, or fewer than four. "like": the wrong entry reads like the average.
    """
    if kind == "like":
        return _like_the_average(rng)
    count = int(rng.choice([2, 3, 6, 7])) if kind == "many" else 3
    values = np.round(rng.uniform(20, 60, count), 1)
    entries = [f"{value:.1f}" for value in values]
    k, j, other = rng.permutation(count)[:3] if kind != "many" else 3 * [int(rng.integers(count))]
    if kind != "many":
        values[j], entries[j] = values[k], entries[k]
    if kind == "beside":
        k = other
    entries[k] = _slipped(rng, entries[k], "one digit wrong")
    if kind == "twice":
        entries[j] = entries[k]
        values[j] = number(entries[k])
    return entries, f"{values.mean():.3f}"


def of_two_slips(rng):
    """A column in which two entries slipped, so that no single slip explains the gap."""
    while True:
        entries, average = column(rng, "one digit wrong")
        k = int(rng.integers(len(entries)))
        entries[k] = _slipped(rng, entries[k], "one digit wrong")
        if not suspects(entries, average) and not _agree(entries, average):
            return entries, average


def printed_twice(rng):
    """A column with two entries printed alike, of which others are named where a slip changes both of them at once."""
    while True:
        entries, average = other_columns(rng, "twice")
        if _alike_changed(entries, average) != suspects(entries, average):
            return entries, average


def of_other_digits(rng):
    """A column in which somebody is suspected, or is not, by what rounding of the numbers allows as they are with the
    slip, and not as they were printed: by a digit too many or missing.
    """
    while True:
        values = np.round(rng.uniform(20, 60, 4), 2)
        entries, k = [f"{value:.2f}" for value in values], int(rng.integers(4))
        average = f"{values.mean():.{int(rng.integers(2, 4))}f}"
        entries[k] = _slipped(rng, entries[k], "one digit wrong")
        gaps = _gaps(entries, average)
        as_tried = _suspected(gaps, 0)
        if as_tried != _suspected(gaps, 0, kept=True) and _suspected(gaps, -1e-7) == _suspected(gaps, 1e-7) == as_tried:
            return entries, average


def of_another_sign(rng):
    """A column, of negative numbers or of positive ones, whose average has the sign of the others."""
    sign, values = rng.choice([-1, 1]), np.round(rng.uniform(20, 60, 4), 1)
    return [f"{sign * value:.1f}" for value in values], f"{-sign * values.mean():.3f}"


def _like_the_average(rng):
    """Entries of which one, with a slip in it, is printed like the average, which all others are to agree with."""
    while True:
        average = f"{rng.uniform(20, 60):.1f}"
        values = np.append(np.round(rng.uniform(20, 60, 2), 1), number(_slipped(rng, average, "one digit wrong")))
        values[0] += 3 * (number(average) - values.mean())
        entries = [*(f"{value:.1f}" for value in values[:2]), average]
        if 20 < values[0] < 60 and 2 in suspects(entries, average):
            order = rng.permutation(3)
            return [entries[k] for k in order], average


COLUMNS = tuple(
    functools.partial(_clear, draw=draw)
    for draw in (
        *(
            functools.partial(column, slip=slip)
            for slip in (
                *("two digits swapped", "one digit wrong", "", "average", "sign lost", "mixed", "alone", "lost"),
                *(*FINE, *AWAY),
            )
        ),
        *(
            functools.partial(at_the_limit, finer=finer, low=low, high=high)
            for finer in (2, 0)
            for low, high in ((1 - LIMIT, 1 - 1e-3), (1 + 1e-3, 1 + LIMIT))
        ),
        of_the_average_alone,
        *(functools.partial(explained_by_both, counted=counted) for counted in ((1, 0), (0, 1))),
        functools.partial(at_the_limit, finer=2, low=BEYOND[0], high=BEYOND[1]),
        *(functools.partial(other_columns, kind=kind) for kind in ("beside", "like")),
        *(functools.partial(of_one_kind, kind=kind) for kind in LEFT_OUT),
    )
)


def _mean(values):
    """Of a few numbers: thousands of these are asked for, and NumPy takes ten times as long."""
    return sum(values) / len(values)


def _agree(entries, average, allowed=None):
    halves = [half_unit(text) for text in entries]
    slack = sum(halves) / len(halves) + half_unit(average) if allowed is None else allowed(halves, half_unit(average))
    off = abs(sum(map(number, entries)) / len(entries) - number(average))
    return off <= slack * (1 + 1e-9) + 1e-12


def suspects(entries, average):
    """Positions of the printed numbers of which one slip explains why entries and average disagree."""
    printed = dict(enumerate([*entries, average]))
    return set(explained_by(printed, lambda d: _agree([d[k] for k in range(len(entries))], d[len(entries)])))


def _search(
    agree=_agree,
    check=True,
    slips=single_slips,
    places=lambda n: range(n + 1),
    first=False,
    give=None,
    first_agree=None,
):
    """A variant of `suspects` that goes another way in one respect."""

    def variant(entries, average):
        if check and (first_agree or agree)(entries, average):
            return set()
        found = set()
        for k in places(len(entries)):
            for other in slips([*entries, average][k]):
                trial = [*entries, average]
                trial[k] = other
                if agree(trial[:-1], trial[-1]):
                    found.add(give(k, other, entries) if give else k)
            if first and found:
                break
        return found

    return variant


def _printed_there(entries, average):
    return {[*entries, average][k] for k in suspects(entries, average)}


def _alike_changed(entries, average):
    """A slip is put wherever its number is printed."""
    printed = [*entries, average]
    if _agree(entries, average):
        return set()
    changed = [
        (k, [o if t == text else t for t in printed]) for k, text in enumerate(printed) for o in single_slips(text)
    ]
    return {k for k, trial in changed if _agree(trial[:-1], trial[-1])}


def _slips_pile_up(entries, average, stops=False):
    """Every slip is tried on a column in which the slips before it still stand; stops: once one explains the gap."""
    printed, found = [*entries, average], set()
    if _agree(entries, average):
        return found
    for k, text in enumerate([*entries, average]):
        for other in single_slips(text):
            printed[k] = other
            if _agree(printed[:-1], printed[-1]):
                found.add(k)
                if stops:
                    break
    return found


def _agree_one_way(entries, average, sign):
    slack = sum(map(half_unit, entries)) / len(entries) + half_unit(average)
    return sign * (sum(map(number, entries)) / len(entries) - number(average)) <= slack * (1 + 1e-9) + 1e-12


def _without_signs_agrees(entries, average):
    slack = sum(map(half_unit, entries)) / len(entries) + half_unit(average)
    mean = sum(abs(number(text)) for text in entries) / len(entries)
    return abs(mean - number(average)) <= slack * (1 + 1e-9) + 1e-12


def _magnitudes_agree(entries, average):
    slack = sum(map(half_unit, entries)) / len(entries) + half_unit(average)
    gap = abs(sum(map(number, entries)) / len(entries)) - abs(number(average))
    return abs(gap) <= slack * (1 + 1e-9) + 1e-12


def _first_half_as_printed(entries, average):
    slack = half_unit(entries[0]) + half_unit(average)
    return _search(agree=_allow(lambda halves, own: slack))(entries, average)


def _within_a_share(share):
    """Entries and average agree where their gap is at most this share of the average."""

    def agree(entries, average):
        return abs(sum(map(number, entries)) / len(entries) - number(average)) <= share * abs(number(average))

    return _search(agree=agree)


def _median_agrees(entries, average):
    slack = sum(map(half_unit, entries)) / len(entries) + half_unit(average)
    return abs(statistics.median(map(number, entries)) - number(average)) <= slack * (1 + 1e-9) + 1e-12


def _cut_to_the_longest(entries, average):
    longest = max(map(len, [*entries, average]))
    return _search(slips=lambda text: [other[:longest] for other in single_slips(text)])(entries, average)


def _average_in_the_mean(entries, average):
    values = [*map(number, entries), number(average)]
    slack = sum(map(half_unit, entries)) / len(entries) + half_unit(average)
    return abs(sum(values) / len(values) - values[-1]) <= slack * (1 + 1e-9) + 1e-12


def _over_one_more(entries, average):
    slack = sum(map(half_unit, entries)) / len(entries) + half_unit(average)
    return abs(sum(map(number, entries)) / (len(entries) + 1) - number(average)) <= slack * (1 + 1e-9) + 1e-12


def _all_over_one_more(entries, average):
    allowed = sum(map(half_unit, entries)) / (len(entries) + 1) + half_unit(average)
    return abs(sum(map(number, entries)) / (len(entries) + 1) - number(average)) <= allowed * (1 + 1e-9) + 1e-12


def _close_agrees(entries, average):
    return bool(np.isclose(sum(map(number, entries)) / len(entries), number(average)))


def _rounded_agrees(decimals):
    """Entries and average agree where their digits do, after rounding to so many decimals."""
    return lambda entries, average: (
        round(sum(map(number, entries)) / len(entries), decimals) == round(number(average), decimals)
    )


def _first_alike(k, other, entries):
    """The position that `index` finds, of several entries that are printed alike the first."""
    return entries.index(entries[k]) if k < len(entries) else k


def _best_alone(entries, average):
    """The one whose slip leaves the smallest gap."""
    if _agree(entries, average):
        return set()
    gaps = []
    for k in suspects(entries, average):
        for other in single_slips([*entries, average][k]):
            trial = [*entries, average]
            trial[k] = other
            if _agree(trial[:-1], trial[-1]):
                gaps.append((abs(_mean(list(map(number, trial[:-1]))) - number(trial[-1])), k))
    return {min(gaps)[1]} if gaps else set()


def _average_at_last(entries, average):
    """The average is suspected where no entry is."""
    found = suspects(entries, average)
    return found - {len(entries)} or found


def _average_before(entries, average):
    """The entries are suspected where the average is not."""
    found = suspects(entries, average)
    return {len(entries)} & found or found


def _left_out_agrees(entries, average, otherwise):
    """Those without whom the others agree with the average as far as all would have to; or `otherwise`."""
    if _agree(entries, average):
        return set()
    slack = sum(map(half_unit, entries)) / len(entries) + half_unit(average)
    x = np.array([number(text) for text in entries])
    means = [np.delete(x, k).mean() if len(x) > 1 else np.nan for k in range(len(x))]
    found = {k for k, mean in enumerate(means) if abs(mean - number(average)) <= slack * (1 + 1e-9)}
    return found or ({len(entries)} if otherwise else found)


def _digits_of_its_own(text):
    """Every digit replaced by every other, a first one by 0 as well."""
    return [text[:k] + d + text[k + 1 :] for k, c in enumerate(text) if c.isdigit() for d in "0123456789"]


def _outlier(entries, average, agree):
    values = np.array([number(text) for text in entries])
    return set() if agree(entries, average) else {int(np.argmax(np.abs(values - values.mean())))}


def _without(kind):
    return lambda text: [other for other, how in single_slips(text).items() if how != kind]


def _only(kind):
    return lambda text: [other for other, how in single_slips(text).items() if how == kind]


def _by_its_own_rounding(entries, average):
    """What each number had to be is computed from the others, and is to be within the half unit of its slip alone."""
    if _agree(entries, average):
        return set()
    x, n = [number(text) for text in entries], len(entries)
    wanted = [n * number(average) - (sum(x) - value) for value in x] + [sum(x) / n]
    return {
        k
        for k, (text, value) in enumerate(zip([*entries, average], wanted))
        if any(abs(number(other) - value) <= half_unit(other) * (1 + 1e-9) for other in single_slips(text))
    }


def _against_the_sum(entries, average):
    slack = sum(map(half_unit, entries)) + half_unit(average)
    return abs(sum(map(number, entries)) - number(average)) <= slack * (1 + 1e-9)


def _allow(rule):
    return functools.partial(_agree, allowed=rule)


TOLERANCES = (
    (
        lambda halves, own: halves[0] + own,
        "You allow the first entry's half unit for all. Each has its own: what they allow together is their mean.",
    ),
    (
        lambda halves, own: max(halves) + own,
        "You allow the largest half unit. The error of a mean is at most the mean of the half units: add "
        "them up, divide by their number.",
    ),
    (
        lambda halves, own: max(*halves, own),
        "You allow the largest half unit of all. Entries and average were rounded: what they allow adds up, the mean "
        "of the entries' half units and the average's.",
    ),
    (
        lambda halves, own: min(halves) + own,
        "You allow the smallest half unit. Each entry has its own: what they allow together is their mean.",
    ),
    (
        lambda halves, own: max(halves) / len(halves) + own,
        "You count the half unit of one entry only. All may be off at once: add them up before you divide.",
    ),
    (
        lambda halves, own: float(np.sqrt(np.sum(np.square(halves)))) / len(halves) + own,
        "The root of the sum of squares is for random errors. What rounding allows is the worst case: add "
        "the half units.",
    ),
    (
        lambda halves, own: float(np.hypot(_mean(halves), own)),
        "The root of the sum of squares is for random errors. What rounding allows is the worst case: add "
        "the half units.",
    ),
    (
        lambda halves, own: float(_mean(halves) / np.sqrt(len(halves))) + own,
        "Divided by the root of their number, half units are taken for random errors, which cancel in part. What "
        "rounding allows is the worst case: their mean as it is.",
    ),
    (
        lambda halves, own: (sum(halves) + own) / (len(halves) + 1),
        "The average's half unit is not divided: its own rounding counts fully, beside the mean of the entries'.",
    ),
)


SUSPECTS = Exercise(
    "suspects",
    reference=suspects,
    draw=COLUMNS,
    metric=metrics.Exactly(),
    noisy=[
        (
            of_other_digits,
            metrics.Exactly(),
            "right, but not where the number with the slip has more digits, or fewer:",
        ),
        *(
            (functools.partial(_clear, draw=draw), metrics.Exactly(), words)
            for draw, words in (
                (printed_twice, "right for entries that all differ, but not where two of them are printed alike:"),
                (of_another_sign, "right, but not where mean and average differ by their sign:"),
                (of_two_slips, "right where a slip explains it, but not where none does, so that nobody is named:"),
                (
                    functools.partial(other_columns, kind="many"),
                    "right for four or five entries, but not for fewer or more:",
                ),
            )
        ),
    ],
    hints=(
        "First: do entries and average agree as printed? Only if not, who could have slipped?",
        "They agree where |mean - average| is at most the mean of the entries' half units plus the average's. Try "
        "every slip of every number, the average too, one at a time.",
        "`def agree(numbers):\n"
        "    x, h = [float(t) for t in numbers], [half_unit(t) for t in numbers]\n"
        "    return abs(np.mean(x[:-1]) - x[-1]) <= np.mean(h[:-1]) + h[-1] + 1e-12\n"
        "printed = [*entries, average]\n"
        "if agree(printed):\n"
        "    return set()\n"
        "return {k for k, text in enumerate(printed)\n"
        "        if any(agree([*printed[:k], other, *printed[k + 1:]]) for other in single_slips(text))}`",
    ),
    mistakes=[
        Mistake(
            _search(check=False),
            "Where entries and average agree as printed, nobody has slipped: return an empty set.",
        ),
        *(
            Mistake(
                _search(agree=functools.partial(_agree_one_way, sign=sign)),
                "You compare the difference with its sign, so that a large one of the other sign agrees with anything: "
                "take its absolute value.",
            )
            for sign in (1, -1)
        ),
        Mistake(
            _search(agree=_magnitudes_agree),
            "You compare mean and average without their signs, so that -40 agrees with 40. Take the absolute value of "
            "their difference alone.",
        ),
        Mistake(
            lambda entries, average: found if len(found := suspects(entries, average)) == 1 else set(),
            "You accuse nobody where several could have slipped. Wanted are all of them.",
        ),
        Mistake(
            lambda entries, average: _suspected(_gaps(entries, average), 1e-9, kept=True),
            "You judge each slip by the half units of the numbers as they were printed. Try it as if it had been "
            "printed, with the half unit of its own digits.",
        ),
        Mistake(
            lambda entries, average: {(k + 1) % (len(entries) + 1) for k in suspects(entries, average)},
            "Your positions count from the average, as if it stood in front. Entries count from 0, and the average "
            "stands behind them, at len(entries).",
        ),
        Mistake(
            _search(slips=lambda text: list(single_slips(text))[:1]),
            "You try the first slip of each number only. Does a `return` end the loop in its first round?",
        ),
        *(
            Mistake(
                _search(agree=_median_agrees, first_agree=first),
                "You compare with the median. An average is the mean: the sum of the entries over their number.",
            )
            for first in (None, _agree)
        ),
        Mistake(
            _cut_to_the_longest,
            "This is what comes out when a slip with a digit more is cut off at the end: a NumPy array of texts keeps "
            "the length of the longest. Keep texts in a list.",
            id="suspects-c74af1",
        ),
        Mistake(
            lambda entries, average: len(suspects(entries, average)),
            "You return how many there are. Wanted are their positions, in a set.",
        ),
        Mistake(
            _search(agree=_allow(lambda halves, own: _mean(halves) + 2 * own)),
            "You allow a whole unit of the average. Rounding hides half of one.",
        ),
        Mistake(
            _search(agree=_allow(lambda halves, own: 2 * _mean(halves) + own)),
            "You allow whole units of the entries. Rounding hides half of one.",
        ),
        Mistake(
            _search(places=lambda n: range(n)),
            "You never name the average. It was printed too, and can carry the slip: try it as well, as the last "
            "position.",
            id="suspects-d30a04",
        ),
        *(
            Mistake(
                _search(agree=_allow(lambda halves, own: 0.0), first_agree=first),
                "All numbers were rounded: agreement to the last bit, or nearly, is too much to ask. Allow what their "
                "half units hide.",
                id=f"suspects-a8851e{which}",
            )
            for first, which in ((None, ""), (_agree, "-2"))
        ),
        *(
            Mistake(
                _search(agree=_allow(lambda halves, own, fixed=fixed: fixed)),
                "You allow the same for every column, however many digits are printed. Allow what the half units of "
                "entries and average hide.",
            )
            for fixed in (0.01, 0.05, 0.1)
        ),
        Mistake(
            lambda entries, average: suspects([str(float(text)) for text in entries], str(float(average))),
            "float() forgets how many digits were printed: 54.940 has three decimals. Take half units and slips from "
            "the texts as they are.",
        ),
        Mistake(
            _search(places=lambda n: [n]),
            "You never name an entry. Each of them can carry the slip as well as the average.",
            id="suspects-8ea51f",
        ),
        Mistake(
            _search(agree=_close_agrees),
            "You allow a small share of the number, as np.isclose does, whatever was printed. Allow what the half "
            "units of entries and average hide.",
            id="suspects-4cfd9e",
        ),
        *(
            Mistake(
                _search(agree=_rounded_agrees(decimals)),
                "You round to the same decimals in every column, however many are printed. Allow what the half units "
                "of entries and average hide.",
            )
            for decimals in (2, 1, 3)
        ),
        Mistake(
            _search(give=_first_alike),
            "Of entries that are printed alike you name the first alone, as `index` finds it. Count the positions: "
            "enumerate does.",
        ),
        Mistake(
            _average_at_last,
            "You suspect the average only where no entry can be it. Both may explain the gap: try all, and name all.",
        ),
        Mistake(
            _average_before,
            "You suspect the entries only where the average cannot be it. Both may explain the gap: try all, and name "
            "all.",
        ),
        *(
            Mistake(
                functools.partial(_left_out_agrees, otherwise=otherwise),
                "You leave one entry out after the other. A slip changes a number, it takes none away: put each of its "
                "single slips in its place.",
            )
            for otherwise in (True, False)
        ),
        *(
            Mistake(
                _search(agree=_allow(lambda halves, own: own), first_agree=first),
                "The entries were rounded as well: their half units, divided by how many there are, add to the "
                "average's.",
            )
            for first in (None, _agree)
        ),
        *(
            Mistake(
                _search(agree=_allow(lambda halves, own: _mean(halves)), first_agree=first),
                "The average was rounded as well: its half unit adds to the mean of the entries'.",
            )
            for first in (None, _agree)
        ),
        Mistake(
            _search(agree=_allow(lambda halves, own: 2 * (_mean(halves) + own))),
            "You allow whole units of the last digit. Rounding hides half of one.",
        ),
        Mistake(
            _search(agree=_allow(lambda halves, own: sum(halves) + own)),
            "The entries' half units go into an average too: divide their sum by how many there are.",
        ),
        Mistake(
            _search(agree=_against_the_sum),
            "You compare the sum with the average: divide by how many entries there are.",
        ),
        Mistake(
            _by_its_own_rounding,
            "What a number had to be, computed from the others, is as inexact as they are: they were rounded too. "
            "Allow what all half units together leave open, not its own alone.",
        ),
        Mistake(
            _search(first=True),
            "You name the first that explains it, and no other. Whether another explains it as well is the point.",
            id="suspects-2beee9",
        ),
        Mistake(
            _best_alone,
            "You name the one whose slip fits best, and no other. Whether another explains it as well is the point.",
        ),
        Mistake(
            _search(give=lambda k, other, entries: k + 1),
            "Positions count from 0 here; the average's is the number of entries.",
        ),
        Mistake(
            _search(give=lambda k, other, entries: k + (k < len(entries))),
            "Positions count from 0 here; the average's is the number of entries.",
        ),
        Mistake(
            _search(give=lambda k, other, entries: -1 if k == len(entries) else k),
            "You give the average position -1. It stands behind the entries: its position is their number.",
        ),
        *(
            Mistake(
                _search(give=give),
                "You return what is printed at the suspects. Wanted are their positions.",
            )
            for give in (
                lambda k, other, entries: [*entries, len(entries)][k],
                lambda k, other, entries: [*entries, "average"][k],
            )
        ),
        Mistake(_printed_there, "You return what is printed at the suspects. Wanted are their positions."),
        Mistake(
            _alike_changed,
            "You put a slip wherever its number is printed. Two may be printed alike: change one position alone.",
        ),
        *(
            Mistake(
                functools.partial(_slips_pile_up, stops=stops),
                "The slips you have tried stay in the column: take a fresh copy for each.",
            )
            for stops in (False, True)
        ),
        Mistake(
            _first_half_as_printed,
            "You allow the first entry's half unit for all. Each has its own: what they allow together is their mean.",
            id="suspects-e587b2",
        ),
        *(Mistake(_search(agree=_allow(rule)), text) for rule, text in TOLERANCES),
        Mistake(
            _search(agree=_average_in_the_mean),
            "Your mean of the entries contains the average, which pulls the two together. Compare it with the mean of "
            "the entries alone.",
        ),
        *(
            Mistake(
                _search(agree=_over_one_more, first_agree=first),
                "You divide by one more than there are entries. The mean of n entries is their sum over n, and that of "
                "their half units too.",
                id=id,
            )
            for first, id in ((_agree, "suspects-9149b8"), (_over_one_more, "suspects-9149b8-2"))
        ),
        Mistake(
            _search(agree=_all_over_one_more),
            "You divide by one more than there are entries. The mean of n entries is their sum over n, and that of "
            "their half units too.",
            id="suspects-2193dd",
        ),
        Mistake(
            lambda entries, average: set() if _agree(entries, average) else set(range(len(entries) + 1)),
            "You accuse everybody, or nearly. Wanted are those of whom one slip makes entries and average agree.",
            id="suspects-1b0ac7",
        ),
        *(
            Mistake(
                functools.partial(_outlier, agree=agree),
                "You accuse the number that stands out. A true value may; wanted is whose slip makes entries and "
                "average agree.",
            )
            for agree in (_agree, _allow(lambda halves, own: own))
        ),
        Mistake(
            _search(give=lambda k, other, entries: other),
            "You return what would have to be printed. Wanted are the positions.",
        ),
        Mistake(
            _search(slips=_without("sign lost")),
            "You leave out lost signs. `single_slips` lists all slips there are: take them as they come.",
        ),
        *(
            Mistake(
                _search(slips=_without(kind)),
                f"You leave out one kind of slip, *{kind}*. `single_slips` lists all slips there are: take them as "
                "they come.",
            )
            for kind in LEFT_OUT
        ),
        Mistake(
            _search(agree=_without_signs_agrees),
            "Your mean is that of the numbers without their signs. Entries below 0 make an average smaller.",
        ),
        *(
            Mistake(
                _within_a_share(share),
                "You allow a share of the average. What rounding explains are half units of the last digits.",
            )
            for share in (0.05, 0.01, 0.005, 0.001)
        ),
        Mistake(
            _search(slips=_only("two digits swapped")),
            "Swapped digits are one kind of slip. `single_slips` lists them all.",
        ),
        *(
            Mistake(
                _search(slips=slips),
                "A wrong digit is one kind of slip. `single_slips` lists them all.",
            )
            for slips in (_only("one digit wrong"), _digits_of_its_own)
        ),
    ],
    draws=len(COLUMNS),
)
