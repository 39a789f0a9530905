"""Units: exact conversion, what a unit measures, and what is refused."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from friction_ocp.errors import FrictionOcpError
from friction_ocp.quantities import DIMENSIONS, SI_UNITS, dimension_of, parse_scale, si_unit, to_si

ROUNDING = 4.0 * np.finfo(float).eps

CONVERSIONS = [
    ("rad", 1.0, "rad"),
    ("deg", np.pi / 180.0, "rad"),
    ("arcmin", np.pi / 180.0 / 60.0, "rad"),
    ("arcsec", np.pi / 180.0 / 3600.0, "rad"),
    ("turn", 2.0 * np.pi, "rad"),
    ("rpm", 2.0 * np.pi / 60.0, "rad/s"),
    ("deg/s", np.pi / 180.0, "rad/s"),
    ("Grad", np.pi / 180.0, "rad"),
    ("Grad/s", np.pi / 180.0, "rad/s"),
    ("Nm/Grad", 180.0 / np.pi, "N m/rad"),
    ("MHz", 1e6, "Hz"),
    ("GN/m", 1e9, "N/m"),
    ("Mohm", 1e6, "ohm"),
    ("rad/s^2", 1.0, "rad/s^2"),
    ("mm", 1e-3, "m"),
    ("um", 1e-6, "m"),
    ("µm", 1e-6, "m"),
    ("mm/s", 1e-3, "m/s"),
    ("m/s**2", 1.0, "m/s^2"),
    ("mA", 1e-3, "A"),
    ("mV", 1e-3, "V"),
    ("kN", 1e3, "N"),
    ("N*m", 1.0, "N m"),
    ("Nm", 1.0, "N m"),
    ("uN m", 1e-6, "N m"),
    ("mNm", 1e-3, "N m"),
    ("ms", 1e-3, "s"),
    ("%", 1e-2, "1"),
    ("1", 1.0, "1"),
    ("dimensionless", 1.0, "1"),
    ("g cm^2", 1e-7, "kg m^2"),
    ("N m s", 1.0, "N m s/rad"),
    ("N m/deg", 180.0 / np.pi, "N m/rad"),
    ("V/rpm", 60.0 / (2.0 * np.pi), "V s/rad"),
    ("mH", 1e-3, "H"),
    ("U/min", 2.0 * np.pi / 60.0, "rad/s"),
    ("tr/min", 2.0 * np.pi / 60.0, "rad/s"),
    ("mV/(r/min)", 1e-3 * 60.0 / (2.0 * np.pi), "V s/rad"),
    ("Ncm", 1e-2, "N m"),
    ("Nmm", 1e-3, "N m"),
    ("gcm^2", 1e-7, "kg m^2"),
    ("kgcm²", 1e-4, "kg m^2"),
    ("‰", 1e-3, "1"),
    ("in/s", 0.0254, "m/s"),
    ("lbf", 4.4482216152605, "N"),
    ("oz-in", 4.4482216152605 * 0.0254 / 16.0, "N m"),
    ("oz-in/A", 4.4482216152605 * 0.0254 / 16.0, "N m/A"),
    ("ft-lb", 4.4482216152605 * 0.3048, "N m"),
    ("kgf cm", 0.0980665, "N m"),
    ("mg_n", 9.80665e-3, "m/s^2"),
]


@pytest.mark.parametrize(("unit", "factor", "target"), CONVERSIONS)
def test_unit_converts_by_its_factor(unit: str, factor: float, target: str) -> None:
    """Every unit drives use converts by its exact factor, and NaN stays NaN."""
    values, found = to_si([3.0, -0.5, np.nan], unit)
    assert found == target
    np.testing.assert_allclose(values, np.array([3.0, -0.5, np.nan]) * factor, rtol=ROUNDING)


@pytest.mark.parametrize(("unit", "value", "expected"), [("degC", 21.5, 21.5), ("°C", 21.5, 21.5), ("K", 273.15, 0.0)])
def test_temperature_becomes_degrees_celsius(unit: str, value: float, expected: float) -> None:
    """Temperatures stay in or become degC, offset included."""
    values, found = to_si([value], unit)
    assert found == "degC"
    assert values[0] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("scale", "count", "expected"),
    [("0.1 K", 2981, 24.95), ("0.5 degC", 43, 21.5), ("0.1 degF", 680, 20.0), ("1 K", 273.15, 0.0)],
)
def test_counts_of_a_temperature_are_scaled_before_the_offset(scale: str, count: float, expected: float) -> None:
    """The offset of a temperature is added to the scaled count, not multiplied by it."""
    values, found = to_si([count, np.nan], "counts", scale=scale)
    assert found == "degC"
    np.testing.assert_allclose(values, [expected, np.nan], rtol=1e-12, atol=1e-10)


@given(st.floats(-1e9, 1e9))
def test_si_units_leave_values_alone(value: float) -> None:
    """A value in an SI unit comes back bit for bit."""
    assert all(to_si([value], unit) == (np.array([value]), unit) for unit in DIMENSIONS.values())


def test_every_si_unit_is_read_as_its_own_dimension() -> None:
    """The tables agree: each dimension's unit measures it, and each kind of quantity has such a unit."""
    assert {dimension: dimension_of(unit) for dimension, unit in DIMENSIONS.items()} == {key: key for key in DIMENSIONS}
    assert all(unit in DIMENSIONS.values() or unit == "V s/m" for units in SI_UNITS.values() for unit in units.values())
    assert SI_UNITS["rotary"].keys() == SI_UNITS["linear"].keys()


@pytest.mark.parametrize(
    ("unit", "dimension"),
    [
        ("deg", "angle"),
        ("mm", "length"),
        ("rpm", "angular_speed"),
        ("mm/s", "linear_speed"),
        ("Hz", "frequency"),
        ("1/s", "frequency"),
        ("N m", "torque"),
        ("N m/rad", "stiffness"),
        ("kN/mm", "linear_stiffness"),
    ],
)
def test_dimension_keeps_the_radian(unit: str, dimension: str) -> None:
    """Angle is a dimension: rad/s is not Hz, N m is not N m/rad, an angle is not a length."""
    assert dimension_of(unit) == dimension


def test_si_unit_follows_the_motion() -> None:
    """A kind of quantity has one unit on a rotary and one on a linear shaft."""
    assert si_unit("torque", motion="rotary") == "N m"
    assert si_unit("torque", motion="linear") == "N"
    assert si_unit("damping") == "N m s/rad"
    with pytest.raises(FrictionOcpError, match=r"unknown kind of quantity 'tork'; available: angle, speed"):
        si_unit("tork")


MISTAKEN = ["Mrad", "Grads", "Mm", "Mm/s", "Gdeg", "1/Ms", "mm/Ms", "megameter", "kN/Mm", "oz-in^2"]
"""Units with a prefix that nobody means, and a mass in ounces, which would read as a force."""


@pytest.mark.parametrize(
    "unit", ["furlong", "", "rad//s", "2 rad", "bar", "m^2", "rad +", "__import__('os')", *MISTAKEN]
)
def test_unknown_unit_is_refused(unit: str) -> None:
    """What is no unit of a drive is refused, with the place and what is accepted."""
    with pytest.raises(FrictionOcpError, match=r"^a.h5: channel 'x': unknown unit '.*'; accepted: rad, deg"):
        to_si([1.0], unit, "a.h5: channel 'x'")


def test_counts_convert_by_their_scale() -> None:
    """Counts need a scale, and convert by it."""
    values, unit = to_si([1024, 4096], "counts", scale="2*pi/4096 rad")
    np.testing.assert_allclose(values, [np.pi / 2.0, 2.0 * np.pi], rtol=ROUNDING)
    assert unit == "rad"
    assert to_si([2], "count", scale="0.5 mA")[0][0] == pytest.approx(1e-3)
    with pytest.raises(
        FrictionOcpError, match=r"m.yaml: unit 'counts' has no scale; counts need a stated scale; state what one"
    ):
        to_si([1], "counts", "m.yaml")
    with pytest.raises(
        FrictionOcpError, match=r"scale '2 rad' stands beside unit 'deg'; a scale belongs to unit 'counts'"
    ):
        to_si([1], "deg", scale="2 rad")


@pytest.mark.parametrize("scale", ["rad", "4096", "2*pi/0 rad", "1..2 rad", "2**3 rad", "0 rad", "exp(1) rad"])
def test_unreadable_scale_is_refused(scale: str) -> None:
    """A scale is numbers and pi joined by * and /, then a unit."""
    with pytest.raises(FrictionOcpError, match="cannot read scale"):
        parse_scale(scale)


def test_pint_is_not_imported_for_si_units() -> None:
    """Reading SI recordings does not pay for pint."""
    code = (
        "import sys; from friction_ocp.quantities import to_si; to_si([1.0], 'N m'); assert 'pint' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
