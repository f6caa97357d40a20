"""Numbers in the manner of metrology: two digits of uncertainty, SI prefixes, a real minus.

Source: JCGM 100:2008 (GUM), 7.2.6; SI brochure (2019), chapter 3 and 5.4.
"""

import math
import re
from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float

# Not float alone: the checks of the tests take the two apart.
Number = float | int
ABSENT = "\N{EN DASH}"
_PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G", 12: "T"}
# Units whose first symbol takes a prefix; metres and seconds only a dividing one (no km, no ks).
_PREFIXED = re.compile(r"(N|Pa|Hz|W|J|V)(?=$|[ /·])")
_DIVIDED = re.compile(r"(m|s)(?=$|[ /·])")
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_DIMENSIONLESS = ("", "-", "1")
_SPACE, _MINUS, _TIMES = "\N{NO-BREAK SPACE}", "\N{MINUS SIGN}", "\N{MULTIPLICATION SIGN}"
# A 90 % interval of a normal law is this many standard deviations wide.
_SDS_IN_90_PERCENT = 3.29
# Least and most significant digits of a number in a table of the terminal.
_TABLE_DIGITS = (5, 8)
# Beyond this ratio of the ends, an interval is read in orders of magnitude, not in decimals.
_ORDERS_APART = 10.0


def superscript(text: str) -> str:
    """A whole number as an exponent: "-3" -> "⁻³"."""
    return text.translate(_SUPERSCRIPT)


def minus(text: str) -> str:
    """Text with the signs of its negative numbers as minus signs."""
    return text.replace("-", _MINUS)


def unit_text(unit: str, exponent: int = 0) -> str:
    """The unit as printed, with the prefix of `exponent`: ("N s/m", 6) -> "MN·s/m"."""
    if unit in _DIMENSIONLESS:
        return ""
    spelled = re.sub(r"\^\{?(-?\d+)\}?", lambda found: superscript(found[1]), unit)
    return _PREFIXES[exponent] + re.sub(r"(?<=\w)[ *](?=\w)", "·", spelled)


def _takes_prefix(unit: str, exponent: int) -> bool:
    if exponent == 0:
        return True
    if exponent not in _PREFIXES or unit == "m/s^2":
        return False
    return bool(_PREFIXED.match(unit)) or (exponent < 0 and bool(_DIVIDED.match(unit)))


def exponent_of(magnitude: Number, unit: str) -> int:
    """The power of ten to take out of a number of this size: by prefix if the unit takes one."""
    if not (math.isfinite(magnitude) and magnitude != 0.0):
        return 0
    order = math.floor(math.log10(abs(magnitude) * (1 + 1e-12)))
    thousands = 3 * (order // 3)
    if _takes_prefix(unit, thousands):
        return thousands
    return 0 if -3 <= order < 5 else order


def _fixed(value: Number, decimals: int) -> str:
    rounded = round(value, decimals)
    return minus(f"{rounded + 0.0:.{max(decimals, 0)}f}")


def _decimals(uncertainty: Number) -> int:
    """Decimals that leave two significant digits of an uncertainty, after its rounding."""
    return 1 - int(f"{abs(uncertainty):.1e}".split("e")[1])


def _with_unit(number: str, unit: str, exponent: int, joined: bool) -> str:
    if exponent and not _takes_prefix(unit, exponent):
        number = f"({number})" if joined else number
        number, exponent = f"{number}{_SPACE}{_TIMES}{_SPACE}10{superscript(str(exponent))}", 0
    printed = unit_text(unit, exponent)
    return f"{number}{_SPACE}{printed}" if printed else number


def exact(value: Number | None, unit: str) -> str:
    """A number as somebody else stated it, no digit added: 1.35e6 -> "1.35 MN·s/m"."""
    if value is None or not math.isfinite(value):
        return ABSENT
    exponent = exponent_of(value, unit)
    return _with_unit(minus(f"{value / 10.0**exponent:.6g}"), unit, exponent, joined=False)


def estimate(value: Number | None, sd: Number | None, unit: str) -> str:
    """Value and standard deviation, two digits of the latter: "60.3 ± 1.2 MN/m"."""
    return _to_sd(value, sd, unit, beside=True)


def significant(value: Number | None, unit: str, digits: int = 3) -> str:
    """A number of ours without its uncertainty beside it: 60312345 -> "60.3 MN/m"."""
    if value is None or not math.isfinite(value):
        return ABSENT
    return exact(float(f"{value:.{digits - 1}e}"), unit)


def rounded(value: Number | None, sd: Number | None, unit: str) -> str:
    """A number alone, to the last digit of its standard deviation: "60.3 MN/m" of 60.3 ± 1.2."""
    return _to_sd(value, sd, unit, beside=False)


def _to_sd(value: Number | None, sd: Number | None, unit: str, *, beside: bool) -> str:
    """Print a number to the last digit of its standard deviation, with that beside it or not."""
    if value is None or not math.isfinite(value):
        return ABSENT
    if sd is None or not (math.isfinite(sd) and sd > 0.0):
        return exact(value, unit)
    exponent = exponent_of(max(abs(value), sd), unit)
    value, sd = value / 10.0**exponent, sd / 10.0**exponent
    decimals = _decimals(sd)
    more = f"{_SPACE}±{_SPACE}{_fixed(sd, decimals)}" if beside else ""
    return _with_unit(_fixed(value, decimals) + more, unit, exponent, joined=beside)


def digits(value: Number | None, unit: str, wanted: int = 2) -> str:
    """As `significant`, with the zeros that count: 1003.2 -> "1.0 kN", not "1 kN"."""
    if value is None or not math.isfinite(value) or value == 0.0:
        return exact(value, unit)
    value = float(f"{value:.{wanted - 1}e}")
    return rounded(value, abs(value) / 10.0 ** (wanted - 2), unit)


def digits_apart(low: Number, high: Number) -> int:
    """Significant digits by which a table of plain numbers tells the ends of an interval apart."""
    size, width = max(abs(low), abs(high)), abs(high - low)
    if not (math.isfinite(size) and width > 0.0):
        return _TABLE_DIGITS[0]
    orders = math.floor(math.log10(size)) - math.floor(math.log10(width))
    return int(np.clip(orders + 2, *_TABLE_DIGITS))


def _scientific(value: Number) -> str:
    mantissa, order = f"{value:.1e}".split("e")
    if -2 <= int(order) <= 2:
        return _fixed(value, 1 - int(order))
    return f"{minus(mantissa)}{_SPACE}{_TIMES}{_SPACE}10{superscript(str(int(order)))}"


def interval(low: Number | None, high: Number | None, unit: str) -> str:
    """The ends of a 90 % interval: "58.4 to 62.2 MN/m", in powers of ten where orders apart."""
    return _joined((low, high), " to ".join, unit)


def median(values: tuple[Number | None, ...], unit: str) -> str:
    """The median of (q05, median, q95), with as many digits as its interval allows."""
    return _joined(values, lambda texts: texts[1], unit)


def median_and_interval(values: tuple[Number | None, ...], unit: str) -> str:
    """Median and 90 % interval of (q05, median, q95): "60.3 (58.4 to 62.2) MN/m"."""
    return _joined(values, lambda texts: f"{texts[1]} ({texts[0]} to {texts[2]})", unit)


def _joined(values: Sequence[Number | None], join: Callable[[list[str]], str], unit: str) -> str:
    numbers = [value for value in values if value is not None and math.isfinite(value)]
    if len(numbers) < len(values):
        return ABSENT
    low, high = numbers[0], numbers[-1]
    if high <= low:
        return exact(high, unit)
    if low * high > 0 and max(high / low, low / high) > _ORDERS_APART:
        printed = unit_text(unit)
        return join([_scientific(number) for number in numbers]) + (printed and _SPACE + printed)
    exponent = exponent_of(max(abs(low), abs(high)), unit)
    ends = [number / 10.0**exponent for number in numbers]
    decimals = _decimals((ends[-1] - ends[0]) / _SDS_IN_90_PERCENT)
    text = join([_fixed(end, decimals) for end in ends])
    return _with_unit(text, unit, exponent, joined=" " in text)


def axis(values: Float[np.ndarray, "..."], unit: str) -> tuple[float, str]:
    """Factor to multiply with and unit to print on an axis that shows these values."""
    finite = np.abs(values[np.isfinite(values)])
    exponent = exponent_of(float(finite.max()), unit) if finite.size else 0
    if exponent and not _takes_prefix(unit, exponent):
        return 10.0**-exponent, f"10{superscript(str(exponent))} {unit_text(unit)}".strip()
    return 10.0**-exponent, unit_text(unit, exponent) or "1"


def count(number: Number | None) -> str:
    """A count in groups of three: 1234567 -> "1 234 567"."""
    if number is None or not math.isfinite(number):
        return ABSENT
    return minus(f"{round(number):,}".replace(",", "\N{NARROW NO-BREAK SPACE}"))


def ratio(number: Number | None, decimals: int = 2) -> str:
    """A pure number with a fixed count of decimals: R-hat, gaps, weights."""
    return _fixed(number, decimals) if number is not None and math.isfinite(number) else ABSENT


def chance(probability: Number | None, decimals: int = 3) -> str:
    """A probability: "0.973"; never 0 or 1, of which no record is sure: "< 0.001", "> 0.999"."""
    if probability is None or not math.isfinite(probability):
        return ABSENT
    least = 10.0**-decimals
    if probability < 0.5 * least:
        return f"< {_fixed(least, decimals)}"
    if probability > 1.0 - 0.5 * least:
        return f"> {_fixed(1.0 - least, decimals)}"
    return _fixed(probability, decimals)


def duration(seconds: Number | None) -> str:
    """A time as people say it: 4350 -> "1 h 12 min"."""
    if seconds is None or not math.isfinite(seconds):
        return ABSENT
    if round(seconds) < 60:
        return f"{seconds:.2g}{_SPACE}s" if seconds < 10 else f"{seconds:.0f}{_SPACE}s"
    minutes, rest = divmod(round(seconds), 60)
    if minutes < 60:
        return f"{minutes}{_SPACE}min {rest}{_SPACE}s"
    return f"{minutes // 60}{_SPACE}h {minutes % 60}{_SPACE}min"
