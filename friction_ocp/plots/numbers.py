"""Numbers and units as a reader wants them: digits follow the uncertainty, never the float."""

from __future__ import annotations

import math
from typing import Any

NOTHING = "–"
_FIXED = range(-4, 6)
_SUPERSCRIPTS = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")


def is_number(value: Any) -> bool:
    """Return whether a value of result.json is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def significant(value: Any, digits: int = 4) -> str:
    """Return a number with `digits` significant digits, or a dash."""
    if not is_number(value):
        return NOTHING
    if value == 0:
        return "0"
    return _written(float(value), _exponent(float(value)) - digits + 1)


def plain(value: Any, digits: int = 6) -> str:
    """Return a number as a person would state it, up to `digits` digits, or a dash."""
    if not is_number(value):
        return NOTHING
    mantissa, _, power = f"{value:.{digits}g}".partition("e")
    return f"{mantissa}e{int(power)}" if power else mantissa


def to_resolution(value: Any, std_error: Any) -> str:
    """Return a number to the second significant digit of its standard error, with 3 to 8 digits."""
    if not is_number(value) or value == 0 or not is_number(std_error) or std_error <= 0:
        return significant(value)
    exponent = _exponent(float(value))
    last = min(max(_exponent(float(std_error)) - 1, exponent - 7), exponent - 2)
    return _written(float(value), last)


def percent(value: Any, digits: int = 3) -> str:
    """Return a fraction as a percentage with `digits` significant digits, or a dash."""
    return f"{significant(100 * value, digits)} %" if is_number(value) else NOTHING


def whole_percent(value: Any) -> str:
    """Return a fraction as a percentage without decimals, or a dash; what is tiny but not zero is below 1 %."""
    if not is_number(value):
        return NOTHING
    return "< 1 %" if 0.0 < value < 0.005 else f"{100 * value:.0f} %"


def unit_text(unit: str) -> str:
    """Return a unit with raised exponents, and nothing for a pure number: kg m^2 is kg m²."""
    if unit == "1":
        return ""
    head, *tails = unit.split("^")
    text = head
    for tail in tails:
        length = len(tail) - len(tail.lstrip("-0123456789"))
        text += tail[:length].translate(_SUPERSCRIPTS) + tail[length:] if length else "^" + tail
    return text


def _exponent(value: float) -> int:
    """Return the decimal exponent of the leading digit."""
    return int(f"{abs(value):e}".partition("e")[2])


def _written(value: float, last: int) -> str:
    """Write a number whose last digit stands for 10^last."""
    exponent = _exponent(value)
    if exponent in _FIXED:
        return f"{value:.{max(0, -last)}f}"
    mantissa, _, power = f"{value:.{max(0, exponent - last)}e}".partition("e")
    return f"{mantissa}e{int(power)}"
