"""Numbers are written to the digits that their uncertainty leaves."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from friction_ocp.plots.numbers import NOTHING, percent, plain, significant, to_resolution, unit_text


@pytest.mark.parametrize(
    ("value", "std_error", "text"),
    [
        (0.11023, 0.00104, "0.1102"),
        (8.9712e7, 2.1e5, "8.971e7"),
        (0.000412, 6.3e-6, "0.0004120"),
        (121000.0, 4e5, "121000"),
        (-2.5e-6, 1e-7, "-2.50e-6"),
        (0.0, 0.1, "0"),
        (3.0, None, "3.000"),
        (None, 1.0, NOTHING),
        (math.nan, 1.0, NOTHING),
    ],
)
def test_digits_follow_the_standard_error(value: float | None, std_error: float | None, text: str) -> None:
    """A value ends at the second digit of its standard error."""
    assert to_resolution(value, std_error) == text


@given(st.floats(-1e12, 1e12), st.floats(1e-12, 1e12))
def test_a_written_number_is_the_number_within_a_twentieth_of_its_error(value: float, std_error: float) -> None:
    """Rounding loses less than the uncertainty hides, beyond eight digits."""
    assert abs(float(to_resolution(value, std_error)) - value) <= max(0.0501 * std_error, 1e-7 * abs(value))


@pytest.mark.parametrize(
    ("unit", "text"),
    [
        ("kg m^2", "kg m²"),
        ("N m s^2/rad^2", "N m s²/rad²"),
        ("1", ""),
        ("N m/sqrt(Hz)", "N m/sqrt(Hz)"),
        ("a^b", "a^b"),
    ],
)
def test_exponents_are_raised(unit: str, text: str) -> None:
    """A unit reads as it is printed in books."""
    assert unit_text(unit) == text


def test_plain_numbers_carry_no_idle_zeros() -> None:
    """A guess and a horizon read as a person wrote them."""
    assert [plain(10.0), plain(8.5e7), plain(0.0005), plain(None)] == ["10", "8.5e7", "0.0005", NOTHING]
    assert significant(0.05437, 2) == "0.054"
    assert percent(0.004) == "0.400 %"
