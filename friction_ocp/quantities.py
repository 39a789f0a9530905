"""SI units: what each kind of quantity is measured in, and exact conversion into it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from friction_ocp.errors import Finding, FrictionOcpError

FloatArray = npt.NDArray[np.float64]
Motion = Literal["rotary", "linear"]

_ROTARY = {
    "angle": "rad",
    "speed": "rad/s",
    "acceleration": "rad/s^2",
    "torque": "N m",
    "inertia": "kg m^2",
    "stiffness": "N m/rad",
    "cubic_stiffness": "N m/rad^3",
    "damping": "N m s/rad",
    "quadratic_damping": "N m s^2/rad^2",
    "torque_constant": "N m/A",
    "back_emf_constant": "V s/rad",
    "process_noise": "N m/sqrt(Hz)",
}
_LINEAR = {
    "angle": "m",
    "speed": "m/s",
    "acceleration": "m/s^2",
    "torque": "N",
    "inertia": "kg",
    "stiffness": "N/m",
    "cubic_stiffness": "N/m^3",
    "damping": "N s/m",
    "quadratic_damping": "N s^2/m^2",
    "torque_constant": "N/A",
    "back_emf_constant": "V s/m",
    "process_noise": "N/sqrt(Hz)",
}
_EITHER = {
    "current": "A",
    "voltage": "V",
    "resistance": "ohm",
    "inductance": "H",
    "time": "s",
    "frequency": "Hz",
    "temperature": "degC",
    "power": "W",
    "dimensionless": "1",
}

SI_UNITS: Mapping[Motion, Mapping[str, str]] = {"rotary": _ROTARY | _EITHER, "linear": _LINEAR | _EITHER}
"""The SI unit of each kind of quantity; a linear shaft uses the same kinds with its own units."""

DIMENSIONS: Mapping[str, str] = (
    {kind: unit for kind, unit in _ROTARY.items() if kind not in ("speed", "acceleration")}
    | {"angular_speed": "rad/s", "angular_acceleration": "rad/s^2"}
    | {"length": "m", "linear_speed": "m/s", "linear_acceleration": "m/s^2", "force": "N", "mass": "kg"}
    | {f"linear_{kind}": _LINEAR[kind] for kind in ("stiffness", "cubic_stiffness", "damping", "quadratic_damping")}
    | {"force_constant": "N/A", "linear_process_noise": "N/sqrt(Hz)"}
    | _EITHER
)
"""What a unit can measure, and the SI unit it converts to."""

# Other products of SI units that mean the same once the radian is taken as 1.
_SAME_WITHOUT_RADIAN = {
    "N m s": "damping",
    "N m s/rad^2": "damping",
    "N m s^2/rad": "inertia",
    "kg m^2/rad": "inertia",
    "N m/rad^2": "stiffness",
    "V s": "back_emf_constant",
}

EXAMPLES = "rad, deg, arcsec, turn, rpm, rad/s, m, mm, m/s, N m, uN m, N, A, mA, V, s, ms, degC, K, 1, %, counts"
_WITHOUT_UNIT = ("1", "dimensionless")
# Of these nobody measures a million: a misspelt mm or deg, or the degree in another language.
_NEVER_SO_LARGE = re.compile(
    r"(?<![^\W\d_])(?:[GM]|giga|mega)"
    r"(?:rad|radian|deg|degree|°|arcmin|arcsec|turn|rev|m|met(?:er|re)|s|sec|second|min|minute|h|hr|hour)s?"
    r"(?![^\W\d_])"
)
_COUNTS = ("count", "counts")

_LETTERS = r"A-Za-zµμ"
_SPELLINGS = (
    (re.compile(rf"(?<![{_LETTERS}])Grad(?![{_LETTERS}])"), "deg"),
    (re.compile(rf"(?<![{_LETTERS}])(?:U|r|tr)/min(?![{_LETTERS}])"), "rpm"),
    (re.compile(rf"(?<![{_LETTERS}])([ckmuµμn]?N)([cm]?m)(?![{_LETTERS}])"), r"\1 \2"),
    (re.compile(rf"(?<![{_LETTERS}])(k?g)([cm]?m)(?=\^|²|\*\*)"), r"\1 \2"),
    (re.compile(rf"(?<![{_LETTERS}])(oz|lb)f?[- ](in|ft)(?![{_LETTERS}])"), r"\1f \2"),
    (re.compile(rf"(?<![{_LETTERS}])(in|ft)[- ](oz|lb)f?(?![{_LETTERS}])"), r"\2f \1"),
)
"""Other spellings of what pint knows; an ounce or a pound over a length is a force there."""

# The radian is a dimension of its own here, so that rad/s, Hz and 1/s, or N m and N m/rad, stay apart.
_UNIT_DEFINITIONS = """
giga- = 1e9 = G-
mega- = 1e6 = M-
kilo- = 1e3 = k-
centi- = 1e-2 = c-
milli- = 1e-3 = m-
micro- = 1e-6 = µ- = μ- = u-
nano- = 1e-9 = n-
meter = [length] = m = metre
second = [time] = s = sec
gram = [mass] = g
ampere = [current] = A = amp
kelvin = [temperature]; offset: 0 = K
radian = [angle] = rad
percent = 0.01
permille = 0.001
minute = 60 * second = min
hour = 60 * minute = h = hr
degree = 0.017453292519943295 * radian = deg = °
arcminute = degree / 60 = arcmin
arcsecond = degree / 3600 = arcsec
milliarcsecond = arcsecond / 1000 = mas
turn = 360 * degree = _ = revolution = rev
rpm = turn / minute
hertz = 1 / second = Hz
newton = kilogram * meter / second ** 2 = N
inch = 0.0254 * meter = in
foot = 12 * inch = ft
standard_gravity = 9.80665 * meter / second ** 2 = g_n
kilogram_force = 9.80665 * newton = kgf
pound_force = 4.4482216152605 * newton = lbf
ounce_force = pound_force / 16 = ozf
joule = newton * meter = J
watt = joule / second = W
volt = watt / ampere = V
ohm = volt / ampere = Ω
henry = volt * second / ampere = H
degree_Celsius = kelvin; offset: 273.15 = degC = celsius
degree_Fahrenheit = 5 / 9 * kelvin; offset: 233.15 + 200 / 9 = degF
"""


def si_unit(kind: str, motion: Motion = "rotary") -> str:
    """Return the SI unit of a kind of quantity, such as "N m" for the torque of a rotary shaft."""
    units = SI_UNITS[motion]
    if kind not in units:
        raise FrictionOcpError(
            Finding("quantities", f"unknown kind of quantity '{kind}'", f"available: {', '.join(units)}")
        )
    return units[kind]


def to_si(
    values: npt.ArrayLike, unit: str, where: str = "quantities", *, scale: str | None = None
) -> tuple[FloatArray, str]:
    """Convert values to SI; `scale` says what one count is, such as "2*pi/4096 rad".

    Temperatures become "degC". Raises FrictionOcpError, at `where`, for a unit that does not convert exactly.
    """
    array = np.asarray(values, dtype=np.float64)
    if unit.strip() not in _COUNTS:
        if scale is not None:
            what = f"scale '{scale}' stands beside unit '{unit}'"
            raise FrictionOcpError(Finding(where, what, "a scale belongs to unit 'counts'", "leave one of them out"))
        target = DIMENSIONS[dimension_of(unit, where)]
        return _convert(array, unit, target), target
    if scale is None:
        remedy = (
            "state what one count is, such as 2*pi/4096 rad, as text: in the attribute `scale` of the dataset of a "
            "recording, or as `scale` in an import map"
        )
        raise FrictionOcpError(Finding(where, f"unit '{unit}' has no scale", "counts need a stated scale", remedy))
    factor, unit_of_scale = parse_scale(scale, where)
    target = DIMENSIONS[dimension_of(unit_of_scale, where)]
    return _convert(array * factor, unit_of_scale, target), target


def dimension_of(unit: str, where: str = "quantities") -> str:
    """Return what a unit measures: a key of `DIMENSIONS`, such as "angle" for "deg" or "length" for "mm"."""
    dimension = _dimension(unit)
    if dimension is None:
        allowed = f"accepted: {EXAMPLES}, and products of them"
        raise FrictionOcpError(Finding(where, f"unknown unit '{unit}'", allowed, "convert the values or correct it"))
    return dimension


def parse_scale(text: str, where: str = "quantities") -> tuple[float, str]:
    """Split "2*pi/4096 rad" into the number before the unit and the unit."""
    match = re.fullmatch(
        r"\s*([-+]?[\d.]+(?:e[-+]?\d+)?|pi)((?:\s*[*/]\s*(?:[\d.]+(?:e[-+]?\d+)?|pi))*)\s+(\S.*)", text
    )
    factor = np.nan
    if match is not None:
        factor = _product(match[1] + match[2])
    if match is None or not np.isfinite(factor) or factor == 0.0:
        allowed = "a number with its unit, which is what one count is, such as 2*pi/4096 rad or 0.001 N m"
        raise FrictionOcpError(Finding(where, f"cannot read scale '{text}'", allowed))
    return factor, match[3].strip()


def _product(text: str) -> float:
    """Return the value of numbers and pi joined by * and /, or NaN."""
    result = 1.0
    operator = "*"
    for token in re.findall(r"[*/]|[^*/\s]+", text):
        if token in "*/":
            operator = token
            continue
        try:
            number = np.pi if token == "pi" else float(token)
            result = result * number if operator == "*" else result / number
        except (ValueError, ZeroDivisionError):
            return float("nan")
    return result


@lru_cache(maxsize=256)
def _dimension(unit: str) -> str | None:
    text = unit.strip()
    known = _dimensions_by_si_spelling().get(text)
    if known is not None:
        return known
    if not text or "//" in text or _NEVER_SO_LARGE.search(_spelling(text)):
        return None
    dimensionality = _dimensionality(text)
    return None if dimensionality is None else _dimensions_by_dimensionality().get(dimensionality)


@lru_cache(maxsize=1)
def _dimensions_by_si_spelling() -> Mapping[str, str]:
    return {unit: dimension for dimension, unit in DIMENSIONS.items()} | {"dimensionless": "dimensionless"}


@lru_cache(maxsize=1)
def _dimensions_by_dimensionality() -> Mapping[frozenset[tuple[str, float]] | None, str]:
    units = _SAME_WITHOUT_RADIAN | {unit: dimension for dimension, unit in DIMENSIONS.items()}
    return {_dimensionality(unit): dimension for unit, dimension in units.items()}


def _dimensionality(unit: str) -> frozenset[tuple[str, float]] | None:
    """Return the exponents of the base dimensions of a unit, or None if it cannot be read."""
    try:
        exponents: Mapping[str, Any] = _registry().Unit(_spelling(unit)).dimensionality
    except Exception:  # pint raises its own errors, ValueError, TypeError and tokenize errors for bad text
        return None
    return frozenset((name, float(exponent)) for name, exponent in exponents.items())


def _convert(values: FloatArray, unit: str, target: str) -> FloatArray:
    if unit.strip() == target or unit.strip() in _WITHOUT_UNIT:
        return values
    registry = _registry()
    source = registry.Unit(_spelling(unit))
    if target != "degC":  # the radian counts as 1, so N m s also converts to N m s/rad
        factor = float(registry.Quantity(1.0, source).to_root_units().magnitude) / _root_factor(target)
        return values * factor
    return np.asarray(registry.Quantity(values, source).to("degC").magnitude, dtype=np.float64)


@lru_cache(maxsize=64)
def _root_factor(unit: str) -> float:
    registry = _registry()
    return float(registry.Quantity(1.0, registry.Unit(_spelling(unit))).to_root_units().magnitude)


def _spelling(unit: str) -> str:
    """Return a unit in the spelling of pint: Nm is N m, % is percent, U/min is rpm, 1 is nothing."""
    text = unit.strip()
    for theirs, ours in (("sqrt(Hz)", "Hz^0.5"), ("%", "percent"), ("‰", "permille"), ("°C", "degC"), ("RPM", "rpm")):
        text = text.replace(theirs, ours)
    for pattern, ours in _SPELLINGS:
        text = pattern.sub(ours, text)
    return "" if text in _WITHOUT_UNIT else text


@lru_cache(maxsize=1)
def _registry() -> Any:
    """Return the only unit registry; pint is imported here because that takes a noticeable time."""
    import pint

    factory: Any = pint.UnitRegistry
    registry: Any = factory(None)
    registry.load_definitions(_UNIT_DEFINITIONS.strip().splitlines())
    return registry
