"""Chapter 10: what a printed digit hides, and which word a comparison deserves."""

import functools
import itertools

import numpy as np

from ...documents.rounding import half_unit
from ...exercises import metrics
from ...exercises.engine import Chapter, Exercise, Prediction
from ...exercises.outcome import Mistake
from .proofs import BOUND, SUSPECTS

FORMS = (
    "d.0d0000",
    "dd",
    "d,d",
    "-0,dd0",
    "de-k",
    "d.d0ek",
    "-d000",
    "dd.d",
    "ddd.dddd",
    "dek",
    "d.de+0k",
    "d.dde-k",
    "d,de-k",
    "d,dek",
    "-d.de-1k",
    "dd.de-k",
    "-0,0ddek",
    "0.0000000000dd",
    "0",
    "0.0d0",
    "0,dd",
    "de1k",
    *("12", "12.0", "12.00", "1.2e1"),  # one number, with four half units
    "0.00",
)  # d: any digit but 0, k: up to 5


def printed_number(rng, form):
    """A number as a document prints it, with digits of its own."""
    return ("".join(str(rng.integers(1, 10 if c == "d" else 6)) if c in "dk" else c for c in form),)


def comparison(rng, off, bound, misprint, simulated, comma, beyond, zero, decimals):
    """printed, value, bound, misprint, simulated; `off` and `bound` in half units of the last printed digit.

    decimals: at least so many are printed. beyond: whether the value is larger than what is printed, signs apart, as
    where digits were cut off. zero: whether the last printed digit is 0.
    """
    decimals = max(2, decimals) if zero else decimals
    half, number = 0.5 * 10.0**-decimals, rng.uniform(20, 90) * rng.choice([-1, 1])
    printed = f"{number:.{decimals - 1}f}0" if zero else f"{number:.{decimals}f}"
    value = float(printed) + (1 if beyond else -1) * off * half * np.sign(number)
    return printed.replace(".", ",") if comma else printed, float(value), bound * half, misprint, simulated


def special_comparison(rng, kind, simulated, beyond):
    """printed, value, bound, misprint, simulated; beyond: whether the value is larger than what is printed, signs apart.

    "sign": the value has the other sign. "edge": it is off by half a unit to the last bit, from an odd number. "limit":
    by half a unit and the bound. "small" and "far": printed with an exponent below 0, and within the half unit or far
    away; "large": with one above 0, within the half unit. "finest" and "fine": six decimals, and the value is off by less
    than half a unit of the last, or by a little more. "above" and "past": off by hardly more than half a unit, or than
    half a unit and the bound. "wide": off by hundreds of thousands, within the bound. "astray": off by as much, and a
    misprint where the value is the larger. "whole": a whole number, of which the last digits are 0.
    "beyond": it is off by a little more than half a unit and the bound, and a misprint where it is the larger. "zero": 0 is
    printed. "digits": eight digits, and the value is off by more than half a unit and the bound.
    """
    misprint, bound = bool(rng.integers(2)), float(rng.integers(1 if kind == "limit" else 0, 4))
    whole = int(rng.integers(2, 90)) * int(rng.choice([-1, 1]))
    side = float(np.sign(whole)) * (1 if beyond else -1)
    if kind == "sign":
        return str(whole), -whole + side * 0.25, bound / 4, misprint, simulated
    if kind == "edge":
        return str(whole | 1), (whole | 1) + 0.5 * side, bound, misprint, simulated
    if kind == "limit":
        return str(whole), whole + side * (0.5 + bound), bound, misprint, simulated
    if kind == "beyond":
        return str(whole), whole + side * (3.5 + rng.uniform(0.2, 0.8)), 3.0, beyond, simulated
    if kind == "whole":
        return f"{whole}00", float(100 * whole + side * rng.uniform(5, 40)), bound, misprint, simulated
    if kind == "zero":
        return "0.0", float(side * rng.uniform(0.01, 0.04)), bound, misprint, simulated
    if kind in ("finest", "fine"):
        printed = f"{whole}{rng.integers(10, 100)}.{rng.integers(10, 100)}{rng.integers(100, 1000)}{rng.integers(3, 7)}"
        return printed, float(printed) + side * (0.3e-6 if kind == "finest" else 0.55e-6), 0.0, misprint, simulated
    if kind in ("above", "past"):
        printed, bound = f"{whole + rng.uniform(-0.4, 0.4):.2f}", 0.005 * (bound if kind == "above" else bound + 1)
        off = (0.005 + bound * (kind == "past")) * (1 + rng.uniform(1e-4, 3e-4))
        return printed, float(printed) + side * off, bound, beyond, simulated
    if kind in ("wide", "astray"):
        printed, wide = f"{whole}{rng.integers(10**5, 10**6)}.{rng.integers(10, 100)}", kind == "wide"
        value = float(printed) + side * rng.uniform(2e5, 4e5)
        return printed, value, 5e5 if wide else 0.005 * bound, misprint if wide else beyond, simulated
    if kind == "digits":
        printed = f"{100000 * whole + rng.uniform(0, 100000):.3f}"
        return printed, float(printed) + side * 2.7 * 0.0005, 1.5 * 0.0005, misprint, simulated
    unit = 100.0 if kind == "large" else 0.01
    value = unit * (whole + side * (9.0 if kind == "far" else 0.3))
    texts = {"large": f"{whole}e2", "far": f"{whole}e-2", "small": f"{whole / 10:.1f}e-1"}
    return texts[kind].replace(".", ","), float(value), bound * unit, misprint, simulated


SPECIAL = tuple(
    (
        functools.partial(special_comparison, kind=kind, simulated=simulated, beyond=beyond),
        metrics.Exactly(),
        f"right on ordinary draws, but not where {words}:",
    )
    for kind, words in (
        ("sign", "the value has the other sign than the printed number"),
        ("edge", "the value is off by half a unit exactly: that is still within"),
        ("limit", "the value is off by half unit and bound exactly: that is still within"),
        ("beyond", "a whole number is printed, and the value is off by a little more than half unit and bound"),
        *((kind, "the number is printed with an exponent, as 3e-4 or 3e4") for kind in ("small", "far", "large")),
        ("zero", "0 is printed"),
        ("whole", "the number is whole and ends with zeros: they are digits like all others"),
        *(
            (kind, "six decimals are printed: the last one is worth a millionth, and half of it is allowed")
            for kind in ("finest", "fine")
        ),
        ("above", "the value is off by hardly more than half a unit: that is no longer within"),
        ("past", "the value is off by hardly more than half unit and bound: that is no longer within"),
        ("wide", "the bound is wide, some hundred thousands: it is allowed as it is"),
        ("astray", "the value is off by hundreds of thousands: however far, the questions stay the same"),
        ("digits", "many digits are printed: what is allowed are half unit and bound, and no share of the number"),
    )
    for simulated, beyond in itertools.product((False, True), repeat=2)
)
NUMBERS = tuple(functools.partial(printed_number, form=form) for form in FORMS)
COMPARISONS = tuple(
    functools.partial(
        comparison,
        off=off,
        bound=bound,
        misprint=misprint,
        simulated=simulated,
        comma=k % 5 == 3,
        beyond=(k // 2 + k // 4) % 2 == 0,
        zero=k % 7 == 2,
        decimals=1 + k % 3,  # all of them with every `off` and `bound`
    )
    for k, (off, bound, misprint, simulated) in enumerate(
        [
            *itertools.product((0.0, 0.4, 1.8, 2.2, 2.7, 60.0), (0.0, 1.5, 100.0), (False, True), (False, True)),
            *((3.2, 1.5, False, simulated) for simulated in (False, True)),
        ]
    )
)


def status(printed, value, bound, misprint, simulated):
    """The word the ledger gives, without its *cut off*."""
    half, off = half_unit(printed) * (1 + 1e-6), abs(value - _number(printed))
    return (_simulated_word if simulated else _real_word)(half, off, bound, misprint)


def _number(printed):
    return float(printed.replace(",", "."))


def _decimals(printed):
    return len(printed.lower().partition("e")[0].replace(",", ".").partition(".")[2])


def _one_unit(printed):
    return 2 * half_unit(printed)


def _without_exponent(printed):
    return 0.5 * 10.0 ** -_decimals(printed)


def _counts_all_digits(printed):
    digits = sum(c.isdigit() for c in printed.lower().partition("e")[0])
    return 0.5 * 10.0 ** (-digits)


def _without_comma(printed):
    return half_unit(printed.partition(",")[0])


def _comma_alone_unread(printed):
    """Decimals behind a comma are not seen, an exponent is."""
    number, mark, exponent = printed.partition("e")
    return half_unit(number.partition(",")[0] + mark + exponent)


def _other_sign(printed):
    return _without_exponent(printed) ** 2 / half_unit(printed)


def _through_float(printed):
    return half_unit(str(_number(printed)))


def _as_float_prints_it(printed):
    """Of the number as Python prints it, in which no zeros at the end are left."""
    return _digits_left(_without_zeros)(repr(_number(printed)))


def _letters_of_the_float(printed):
    """The same, all letters behind the point counted, an exponent's among them; where there is no point it fails."""
    return 0.5 * 10.0 ** -len(repr(_number(printed)).split(".")[1])


def _of_the_value(printed):
    return 0.005 * abs(_number(printed))


def _digits_left(strip):
    """Count the decimals of what `strip` leaves of the number before its exponent."""

    def variant(printed):
        number, _, exponent = printed.replace(",", ".").partition("e")
        decimals = len(strip(number).partition(".")[2])
        return 0.5 * 10.0 ** (int(exponent or 0) - decimals)

    return variant


def _without_zeros(number):
    return number.rstrip("0") if "." in number else number


def _significant_digits(counted, before=1):
    """The last of the digits counted, where so many of them stand before the point."""

    def variant(printed):
        number, _, exponent = printed.replace(",", ".").partition("e")
        return 0.5 * 10.0 ** (int(exponent or 0) - len(counted(number.replace(".", "").lstrip("-"))) + before)

    return variant


def _four_digits(printed):
    return 0.5 * 10.0 ** (np.floor(np.log10(abs(_number(printed)))) - 3)


def _first_digit(printed):
    return 0.5 * 10.0 ** np.floor(np.log10(abs(_number(printed))))


def _until_whole(printed):
    """Ten times as much until no decimals are left, of the number: zeros at the end are not seen."""
    x, half = _number(printed), 0.5
    while abs(x - round(x)) > 1e-9:
        x, half = 10 * x, half / 10
    return half


def _negative_exponents_alone(printed):
    """As with a split at "e-": what stands behind another exponent's point is all counted as decimals."""
    return half_unit(printed) if "e-" in printed else _ends_at_the_exponent(printed)


def _only_the_exponent(printed):
    exponent = printed.partition("e")[2]
    return 0.5 * 10.0 ** int(exponent) if exponent else half_unit(printed)


def _ends_at_the_exponent(printed):
    """The decimals as the letters behind the point, the exponent's among them; 0.5 without a point."""
    decimals = printed.replace(",", ".").partition(".")[2]
    return 0.5 * 10.0 ** -len(decimals)


def _exponent_twice(printed):
    """The decimals as the letters behind the point, the exponent's among them, which shifts it as well."""
    return _ends_at_the_exponent(printed) * 10.0 ** int(printed.partition("e")[2] or 0)


def _letters_behind_the_point(printed):
    """The same, where an exponent is read only if there is no point."""
    has_a_point = "." in printed.replace(",", ".")
    return _ends_at_the_exponent(printed) if has_a_point else half_unit(printed)


def _exponent_of_the_size(printed):
    """The exponent as it would be with one digit before the point."""
    mantissa, mark, _ = printed.partition("e")
    return half_unit(mantissa) * 10.0 ** np.floor(np.log10(abs(_number(printed)))) if mark else half_unit(printed)


def _exponents_above_0_dropped(printed):
    number, _, exponent = printed.partition("e")
    return half_unit(printed if exponent.startswith("-") else number)


def _exponents_with_a_plus_dropped(printed):
    number, _, exponent = printed.partition("e")
    return half_unit(number if exponent.startswith("+") else printed)


def _exponents_below_0(printed):
    """Every exponent read as a negative one."""
    number, _, exponent = printed.partition("e")
    return half_unit(number) * 10.0 ** -abs(int(exponent or 0))


def _all_letters_without_a_point(printed):
    """As with `find`, which gives -1 where there is no point."""
    number, _, exponent = printed.replace(",", ".").partition("e")
    return 0.5 * 10.0 ** (int(exponent or 0) - (len(number) - number.find(".") - 1))


def _hundreds(printed):
    whole, _, decimals = printed.strip("-").replace(",", ".").partition(".")
    return 0.5 / 10 ** len(decimals) if decimals else 0.5 * 10 ** (len(whole) - len(whole.rstrip("0")))


def _trailing_zeros(printed):
    """Decimals without the zeros at the end, of the whole text: an exponent is not read."""
    return 0.5 * 10.0 ** -len(printed.replace(",", ".").rstrip("0").partition(".")[2])


def _whole_is_exact(printed):
    return 0.0 if printed.lstrip("-").isdigit() else half_unit(printed)


def _whole_zeros_do_not_count(printed):
    zeros = len(printed) - len(printed.rstrip("0")) if printed.lstrip("-").isdigit() else 0
    return half_unit(printed) * 10**zeros


def _with_the_sign(printed):
    return -half_unit(printed) if printed.startswith("-") else half_unit(printed)


def _judged(real, simulated=None):
    """Words by two rules (half, off, bound, misprint) -> word: for real values and, by default the right one, simulated
    ones.
    """

    def variant(printed, value, bound, misprint, is_simulated):
        half, off = half_unit(printed) * (1 + 1e-6), abs(value - _number(printed))
        return ((simulated or _simulated_word) if is_simulated else real)(half, off, bound, misprint)

    return variant


def _simulated_word(half, off, bound, misprint):
    return "consistent" if off <= half + bound else "not computable"


def _real_word(half, off, bound, misprint):
    if off <= half:
        return "reproduced"
    return "rounding" if off <= half + bound else "misprint" if misprint else "contradiction"


def _signed(printed, value, bound, misprint, simulated):
    value = max(value, _number(printed))
    return status(printed, value, bound, misprint, simulated)


def _signed_up(printed, value, bound, misprint, simulated):
    value = min(value, _number(printed))
    return status(printed, value, bound, misprint, simulated)


def _root_of_squares(printed, value, bound, misprint, simulated):
    half = half_unit(printed)
    return status(printed, value, np.hypot(half, bound) - half, misprint, simulated)


def _within_a_unit(printed, value, bound, misprint, simulated):
    rule = _simulated_word if simulated else _real_word
    return rule(2 * half_unit(printed) * (1 + 1e-6), abs(value - _number(printed)), bound, misprint)


def _relative(printed, value, bound, misprint, simulated):
    rule = _simulated_word if simulated else _real_word
    off = abs(value - _number(printed)) / abs(_number(printed))
    return rule(half_unit(printed) * (1 + 1e-6), off, bound, misprint)


def _rounded_to(digits):
    return lambda p, v, b, m, s: status(p, round(v, digits), b, m, s)


def _without_reading_commas(printed, value, bound, misprint, simulated):
    float(printed)
    return status(printed, value, bound, misprint, simulated)


def _close_by_default(printed, value, bound, misprint, simulated):
    """With np.isclose, which allows a share of the printed number as well."""
    rule, more = _simulated_word if simulated else _real_word, 1e-5 * abs(_number(printed))
    return rule(half_unit(printed) + more, abs(value - _number(printed)), bound, misprint)


def _half_of_all(half):
    """With one half unit for all numbers, however many digits are printed."""

    def variant(printed, value, bound, misprint, simulated):
        rule = _simulated_word if simulated else _real_word
        return rule(half * (1 + 1e-6), abs(value - _number(printed)), bound, misprint)

    return variant


def _half_of_the_number(share):
    """With a share of the printed number in place of its half unit."""

    def variant(printed, value, bound, misprint, simulated):
        rule, number = _simulated_word if simulated else _real_word, _number(printed)
        return rule(share * abs(number), abs(value - number), bound, misprint)

    return variant


def _half_through_float(printed, value, bound, misprint, simulated):
    rule, off = _simulated_word if simulated else _real_word, abs(value - _number(printed))
    return rule(_through_float(printed) * (1 + 1e-6), off, bound, misprint)


def _as_text(strip):
    """Reproduced is what is the printed text when it is written with as many decimals; `strip`: of what is printed."""

    def variant(printed, value, bound, misprint, simulated):
        same = f"{value:.{_decimals(printed)}f}" == strip(printed)
        if simulated or same:
            return "reproduced" if same and not simulated else status(printed, value, bound, misprint, simulated)
        word = status(printed, value, bound, misprint, simulated)
        return "rounding" if word == "reproduced" else word

    return variant


def _cut_off(printed, value, bound, misprint, simulated):
    word, off = status(printed, value, bound, misprint, simulated), abs(value) - abs(_number(printed))
    rest = word not in ("reproduced", "consistent", "not computable")
    return "cut off" if rest and 0 < off < 2 * half_unit(printed) else word


STATUSES = (
    (
        _close_by_default,
        "You allow something besides, a share of the number perhaps, as np.isclose does unless you write rtol=0. Half unit and bound are all that is allowed.",
        "status-54d06c",
    ),
    *(
        (
            variant,
            "What is allowed for the half unit does not follow from the digits that are printed: half_unit(printed).",
            f"status-3e881c{number}",
        )
        for variant, number in zip(map(_half_of_all, (0.005, 0.05, 0.5, 0.0005)), ("", "-2", "-3", "-4"))
    ),
    *(
        (
            _half_of_the_number(share),
            "What is allowed for the half unit does not follow from the digits that are printed: half_unit(printed).",
        )
        for share in (0.005, 0.01, 0.05, 0.001)
    ),
    (
        _half_through_float,
        "float() forgets how many digits were printed: 43.00 has two decimals. Take the half unit from the string.",
    ),
    (
        _as_text(str),
        "You compare texts, and some are printed with a comma. Compare numbers: the difference with the half unit.",
    ),
    (
        lambda p, v, b, m, s: status(p, v, 2 * b, m, s),
        "You allow twice the bound. It holds to either side: half unit + bound, once.",
    ),
    (
        lambda p, v, b, m, s: status(p, v, b * abs(v), m, s),
        "You take the bound as a share of the number. It has the number's own unit: half unit + bound.",
        "status-d5f11e",
    ),
    (_cut_off, "*Cut off* is left out here: what is off by less than a whole unit is judged as all else."),
    (
        _judged(_real_word, lambda h, o, b, m: "consistent" if o <= b else "not computable"),
        "A simulation stands beside a number that was rounded: compare with half unit + bound, not with the bound alone.",
    ),
    (
        _judged(
            lambda h, o, b, m: (
                "reproduced" if o <= h + b else "rounding" if o <= h + 2 * b else "misprint" if m else "contradiction"
            )
        ),
        "You allow the bound for *reproduced* already. That is said within the half unit; within half unit + bound it is *rounding*.",
    ),
    (
        _judged(lambda h, o, b, m: "reproduced" if o <= h + b else "misprint" if m else "contradiction"),
        "You allow the bound for *reproduced* already. That is said within the half unit; within half unit + bound it is *rounding*.",
    ),
    (_without_reading_commas, "float() does not read a decimal comma: replace it by a point first."),
    (_judged(_real_word, _real_word), "`simulated` does not enter yet: without the inputs nothing is reproduced."),
    (
        _judged(_real_word, lambda h, o, b, m: "reproduced" if o <= h else "consistent"),
        "Ask for `simulated` first. A simulated value is *consistent* within half unit and bound, else *not computable*.",
    ),
    (
        _judged(_real_word, lambda h, o, b, m: "reproduced" if o <= h else _simulated_word(h, o, b, m)),
        "Ask for `simulated` first. A simulated value is *consistent* within half unit and bound, else *not computable*.",
    ),
    (
        _judged(_real_word, lambda h, o, b, m: _real_word(h, o, b, m) if o <= h + b else "consistent"),
        "Ask for `simulated` first. A simulated value is *consistent* within half unit and bound, else *not computable*.",
    ),
    (
        _judged(_real_word, lambda h, o, b, m: "not computable" if o <= h + b else "consistent"),
        "A simulation within half unit and bound stands beside the printed number: consistent. Yours is turned round.",
    ),
    *(
        (
            _judged(
                _real_word, lambda h, o, b, m, word=word: "consistent" if o <= h + b else "misprint" if m else word
            ),
            "A simulation far from the printed value proves no misprint: the row is not computable.",
        )
        for word in ("contradiction", "not computable")
    ),
    (
        _judged(_real_word, lambda h, o, b, m: "consistent" if o <= h else "not computable"),
        "A simulation has its bound as well: compare with half unit + bound.",
    ),
    (
        _judged(lambda h, o, b, m: _real_word(h, o, b, True)),
        "`misprint` does not enter yet: without a proof the word is *contradiction*.",
    ),
    (
        _judged(lambda h, o, b, m: _real_word(h, o, b, False)),
        "`misprint` does not enter yet: where it is True nothing milder is left, and the word is *misprint*.",
    ),
    (
        _judged(lambda h, o, b, m: _real_word(h, o, b, not m)),
        "`misprint` is turned round: True means that a misprint is proved.",
    ),
    (
        _judged(
            lambda h, o, b, m: "misprint" if m else _real_word(h, o, b, m),
            lambda h, o, b, m: "misprint" if m else _simulated_word(h, o, b, m),
        ),
        "Ask for `simulated` first, then for *reproduced* and *rounding*, and only then for *misprint*.",
        "status-e25a21",
    ),
    (
        _judged(lambda h, o, b, m: "rounding" if o <= h + b else _real_word(h, o, b, m)),
        "Ask for *reproduced* before *rounding*: what is within the half unit is within half unit + bound too.",
    ),
    (
        _judged(
            lambda h, o, b, m: "reproduced" if o < h / 100 else "rounding" if o <= h + b else _real_word(h, o, b, m)
        ),
        "Equal to the printed *digits* is enough: reproduced reaches to half a unit of the last digit.",
    ),
    (
        _judged(
            lambda h, o, b, m: (
                "reproduced" if o <= h else "rounding" if o <= b else "misprint" if m else "contradiction"
            ),
            lambda h, o, b, m: "consistent" if o <= b else "not computable",
        ),
        "Compare with half unit + bound: the printed number itself was rounded too.",
    ),
    (
        _judged(
            lambda h, o, b, m: (
                "reproduced" if o <= h else "rounding" if o <= b else "misprint" if m else "contradiction"
            )
        ),
        "Compare with half unit + bound: the printed number itself was rounded too.",
    ),
    (
        lambda p, v, b, m, s: status(p, round(v, _decimals(p)), b, m, s),
        "You rounded first, the value or the difference, which moves it by up to half a unit more: compare what was computed.",
        "status-ef196d",
    ),
    (
        _judged(lambda h, o, b, m: "reproduced" if o <= 2 * h else _real_word(h, o, b, m)),
        "You call *reproduced* what is off by a whole unit of the last digit. Rounding hides half of it.",
    ),
    (
        _relative,
        "You take half unit and bound as shares of the printed number. They are in the unit of the value: compare the difference itself.",
        "status-e17f9e",
    ),
    *(
        (
            _rounded_to(digits),
            "You rounded first, the value or the difference, always to the same decimals: compare what was computed.",
            id,
        )
        for digits, id in ((2, "status-da4190"), (3, "status-da4190-2"), (1, "status-da4190-3"))
    ),
    (
        _judged(
            _real_word, lambda h, o, b, m: "consistent" if o <= h else "rounding" if o <= h + b else "not computable"
        ),
        "A simulation within half unit and bound together is *consistent*: *rounding* is said of published inputs.",
    ),
    *(
        (
            _judged(_real_word, lambda h, o, b, m, word=word: "consistent" if o <= h + b else word),
            "The word for a simulation that lands elsewhere is *not computable*, written like this.",
        )
        for word in ("not consistent", "inconsistent", "undecided", "unknown")
    ),
    (_within_a_unit, "You compare with a whole unit of the last digit. Rounding hides half of it."),
    (_signed, "A value below the printed one is off as well: take the absolute difference."),
    (_signed_up, "A value above the printed one is off as well: take the absolute difference."),
    (
        _root_of_squares,
        "Half unit and bound add up as they are: a bound must hold in the worst case, the root of squares does not.",
    ),
    (
        _judged(lambda h, o, b, m: _real_word(h, o, b, m).replace("contradiction", "refuted")),
        "What is left in the end is a *contradiction*: *refuted* is said of claims, and left out here.",
    ),
    (
        _judged(_real_word, lambda h, o, b, m: "consistent" if o <= h + b else "contradiction"),
        "A simulation far from the printed value contradicts nothing: its inputs were never published, so the row is not computable.",
    ),
    (
        _judged(
            lambda h, o, b, m: "misprint" if m else _real_word(h, o, b, m),
        ),
        "Ask for *reproduced* and *rounding* before *misprint*: a number that comes out is no misprint.",
        "status-34b61e",
    ),
    (
        _judged(
            _real_word,
            lambda h, o, b, m: _real_word(h, o, b, True) if o <= h + b or m else "not computable",
        ),
        "Ask for `simulated` first: without the inputs nothing is reproduced, and no misprint proved.",
    ),
)


def _status(order, careful=False):
    """Ask for the words in another order; `careful`: a simulation that lands elsewhere decides nothing, as it should be."""

    def variant(printed, value, bound, misprint, simulated):
        half = half_unit(printed)
        off = abs(value - _number(printed))
        within = off <= (half + bound) * (1 + 1e-6)
        tests = {
            "reproduced": off <= half * (1 + 1e-6) and not simulated,
            "rounding": within and not simulated,
            "consistent": simulated and (within or not careful),
            "misprint": misprint,
            "not computable": simulated and careful,
        }
        return next((word for word in order if tests[word]), "contradiction")

    return variant


CHAPTER = Chapter(
    "10-ledger",
    title="The ledger",
    items=[
        Prediction(
            "digits",
            question="A document prints 0.37. Its own inputs give 0.3746. What is that?",
            choices=("reproduced", "a rounding difference", "a misprint"),
            answer="reproduced",
            why="0.3746 rounds to 0.37: nothing is off. A printed number is an interval, here from 0.365 to 0.375.",
        ),
        Exercise(
            "half_unit",
            reference=half_unit,
            draw=NUMBERS,
            metric=metrics.Numbers(1e-6, least=0.0),
            hints=(
                "Which digit was rounded? Half a unit of that digit can be hidden.",
                "With d decimals it is 0.5 * 10**-d. An exponent, as in 3e-4, shifts that; a comma is a decimal point.",
                "`number, _, exponent = printed.partition('e')\n"
                "d = len(number.replace(',', '.').partition('.')[2])\n"
                "return 0.5 * 10.0 ** (int(exponent or 0) - d)`",
            ),
            mistakes=[
                Mistake(
                    _one_unit, "That is a whole unit of the last digit. Rounding moves a number by half of it at most."
                ),
                Mistake(
                    _without_exponent,
                    "In 3e-4 the last digit is worth 0.0001, not 1: the exponent shifts the half unit.",
                ),
                Mistake(
                    _counts_all_digits, "You counted all digits. Only those after the decimal point make it finer."
                ),
                *(
                    Mistake(variant, "The comma of 1,5 is a decimal point: this number has one decimal, not none.")
                    for variant in (_without_comma, _comma_alone_unread)
                ),
                Mistake(
                    _other_sign, "3e-4 is 3 times 10 to the power -4: your exponent shifts the half unit the wrong way."
                ),
                *(
                    Mistake(
                        variant,
                        "A number, as float() makes it, forgets how many digits were printed: 1.010000 has six decimals, 12 has none. Work on the string.",
                        id=f"half_unit-6298d2{which}",
                    )
                    for variant, which in (
                        (_through_float, ""),
                        (_as_float_prints_it, "-2"),
                        (_letters_of_the_float, "-3"),
                    )
                ),
                Mistake(
                    _digits_left(_without_zeros),
                    "Zeros at the end are digits too: 1.010000 has six decimals, and says more than 1.01.",
                ),
                Mistake(_whole_is_exact, "12 is rounded as well: it can be anything from 11.5 to 12.5."),
                Mistake(
                    _whole_zeros_do_not_count,
                    "Here all printed digits count, the zeros of -1000 too: its last digit is worth 1.",
                ),
                *(
                    Mistake(
                        _significant_digits(counted, before),
                        "You counted digits, all of them or the significant ones. What the last digit is worth depends on its place alone, before the point or behind it: 86 and 1086 hide the same.",
                    )
                    for counted in (lambda digits: digits.lstrip("0"), lambda digits: digits)
                    for before in (1, 0)
                ),
                Mistake(
                    _four_digits,
                    "You assume four digits for every number. How many were printed is seen in the string alone.",
                ),
                Mistake(
                    _only_the_exponent,
                    "3.20e3 has two decimals and an exponent: both count, its last digit is worth 10.",
                ),
                Mistake(
                    _ends_at_the_exponent,
                    "An exponent is not read yet: in 3.20e3 two decimals stand before it, and it shifts the half unit by three places.",
                ),
                *(
                    Mistake(
                        variant,
                        "The letters of the exponent are counted as decimals: 1.5e-3 has one, the 5. Take the exponent off first.",
                    )
                    for variant in (_exponent_twice, _letters_behind_the_point)
                ),
                *(
                    Mistake(
                        variant,
                        "Zeros at the end were printed like any other digit, and an exponent is no decimal: cut off nothing but the exponent, and count it for itself.",
                    )
                    for variant in (_hundreds, _trailing_zeros)
                ),
                Mistake(_first_digit, "You take the place of the first digit. Rounded was the last one."),
                Mistake(
                    _until_whole,
                    "A number does not know how it was printed: zeros at its end are lost. Count the decimals in the string.",
                ),
                *(
                    Mistake(
                        variant,
                        "An exponent may be positive as well: 3.20e3 has two decimals, and its last digit is worth 10.",
                    )
                    for variant in (_negative_exponents_alone, _exponents_below_0, _exponents_above_0_dropped)
                ),
                Mistake(
                    _exponents_with_a_plus_dropped,
                    "An exponent may stand behind a plus: 3.2e+03 has one decimal, and its last digit is worth 100.",
                    id="half_unit-plus",
                ),
                Mistake(
                    _exponent_of_the_size,
                    "You take the exponent from the size of the number, which tells it where one digit stands before the point: 44.1e-1 "
                    "is 4.41, and its exponent is -1. Read it from the string.",
                ),
                Mistake(
                    _all_letters_without_a_point,
                    "Where there is no point, all letters are counted as decimals. A whole number has no decimals (`find` gives -1 there).",
                    id="half_unit-42466f",
                ),
                Mistake(_with_the_sign, "Half a unit is a size, without a sign: that of -0,250 is 0.0005."),
                Mistake(
                    lambda printed: 0.5 * 10.0 ** _decimals(printed),
                    "More decimals make the half unit smaller: the power of ten is negative.",
                ),
                Mistake(
                    lambda printed: float(_decimals(printed)),
                    "You counted the decimals. With d of them half a unit is 0.5 * 10**-d.",
                ),
                Mistake(
                    lambda printed: 10 * half_unit(printed),
                    "That is five units of the last digit: with d decimals half a unit is 0.5 * 10**-d.",
                ),
                Mistake(
                    lambda printed: half_unit(printed) / 10,
                    "That is a tenth of half a unit: with d decimals half a unit is 0.5 * 10**-d.",
                    "half_unit-36c0ef",
                ),
                Mistake(
                    _of_the_value, "You took a share of the value. The unit of the last digit does not depend on it."
                ),
            ],
            draws=len(FORMS) + 4,
        ),
        BOUND,
        Exercise(
            "status",
            reference=status,
            draw=COMPARISONS,
            metric=metrics.Exactly(),
            noisy=SPECIAL,
            hints=(
                "Ask the questions in an order: was the input published at all? Does the value round to the printed one? ...",
                "off = |value - printed| against half_unit(printed), then against half_unit(printed) + bound. A simulated value within "
                "either of them is 'consistent', outside 'not computable'.",
                "`half = half_unit(printed) + 1e-9\n"
                "off = abs(value - float(printed.replace(',', '.')))\n"
                "if simulated:\n"
                "    return 'consistent' if off <= half + bound else 'not computable'\n"
                "if off <= half:\n"
                "    return 'reproduced'\n"
                "if off <= half + bound:\n"
                "    return 'rounding'\n"
                "return 'misprint' if misprint else 'contradiction'`",
            ),
            mistakes=[
                Mistake(
                    _status(("misprint", "reproduced", "rounding", "consistent")),
                    "You ask for the misprint first. A number that comes out, or was never published, is no misprint.",
                ),
                Mistake(
                    _status(("consistent", "reproduced", "rounding", "misprint")),
                    "A simulation far from the printed value does not stand beside it: the row is not computable.",
                ),
                Mistake(
                    _status(("reproduced", "rounding", "misprint", "consistent")),
                    "A simulated value is never a misprint: without the inputs nothing can be proved.",
                ),
                Mistake(
                    _status(("consistent", "not computable", "reproduced", "misprint", "rounding"), careful=True),
                    "You ask for the misprint before rounding. What the bound explains needs no misprint: the milder word wins.",
                ),
                Mistake(
                    lambda p, v, b, m, s: status(p, v, max(0.0, b - half_unit(p)), m, s),
                    "Half unit and bound add up: the printed number was rounded, and so were its inputs.",
                ),
                Mistake(
                    lambda p, v, b, m, s: status(p, v, 0.0, m, s),
                    "The bound is missing: rounded inputs may move the value by that much more.",
                ),
                *(Mistake(variant, text, *id) for variant, text, *id in STATUSES),
            ],
            draws=len(COMPARISONS),
        ),
        SUSPECTS,
    ],
)
