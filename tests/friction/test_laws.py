"""Every friction law: one table of laws, one table of properties."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest

from friction_ocp.friction.bristle import Dahl, LuGre
from friction_ocp.friction.element import FrictionElement, LoadDependence
from friction_ocp.friction.gms import GeneralizedMaxwellSlip, MaxwellElement
from friction_ocp.friction.law import AbstractFrictionLaw
from friction_ocp.friction.polyline_hysteresis import PolylineHysteresis
from friction_ocp.friction.registry import BUILT_IN, friction_laws
from friction_ocp.friction.static import Coulomb, CoulombViscous, NoFriction, Polyline, Quadratic, Stribeck, Viscous
from friction_ocp.parameters import Directional, leaves

ROUNDING = 1e-14
FLOOR_OF_POWER = 1e-8
"""Speed over Stribeck speed below which `power` is level, so that its derivative stays finite."""


def stribeck(speed: float, delta: float) -> float:
    """0.2 N m of Coulomb friction, 0.3 N m at breakaway, falling over 4 rad/s."""
    return 0.2 + 0.1 * math.exp(-((speed / 4.0) ** delta)) + 0.01 * speed


def polyline(speed: float) -> float:
    """0.02 N m s/rad up to 5 rad/s, 0.004 up to 15 rad/s, 0.01 beyond."""
    return 0.2 + 0.02 * min(speed, 5.0) + 0.004 * min(max(speed - 5.0, 0.0), 10.0) + 0.01 * max(speed - 15.0, 0.0)


LAWS: dict[str, tuple[AbstractFrictionLaw, Callable[[float], float]]] = {
    "none": (NoFriction(), lambda w: 0.0),
    "coulomb": (Coulomb(0.2), lambda w: 0.2),
    "viscous": (Viscous(0.03), lambda w: 0.03 * w),
    "coulomb_viscous": (CoulombViscous(0.2, 0.03), lambda w: 0.2 + 0.03 * w),
    "stribeck": (Stribeck(0.2, 0.3, 4.0, 0.01), lambda w: stribeck(w, 2.0)),
    "stribeck sharp": (Stribeck(0.2, 0.3, 4.0, 0.01, 0.7), lambda w: stribeck(w, 0.7)),
    "polyline": (Polyline(0.2, (0.02, 0.004, 0.01), (5.0, 15.0)), polyline),
    "polyline through zero": (
        Polyline(0.2, (0.02, 0.004, 0.01), (5.0, 15.0), 0.5),
        lambda w: polyline(w) if w >= 0.5 else w / 0.5 * polyline(0.5),
    ),
    "quadratic": (Quadratic(0.2, 0.01, 0.002), lambda w: 0.2 + 0.01 * w + 0.002 * w**2),
    "dahl": (Dahl(0.2, 500.0, 0.01), lambda w: 0.2 + 0.01 * w),
    "lugre": (LuGre(0.2, 0.3, 4.0, 500.0, 0.5, 0.01), lambda w: stribeck(w, 2.0)),
    "gms": (
        GeneralizedMaxwellSlip((MaxwellElement(500.0, 0.3), MaxwellElement(100.0, 0.7)), 0.2, 0.3, 4.0, 0.01),
        lambda w: stribeck(w, 2.0),
    ),
    "polyline_hysteresis": (PolylineHysteresis(Polyline(0.2, (0.02, 0.004, 0.01), (5.0, 15.0)), 1e-3), polyline),
}
SPEEDS = np.array([0.0, 0.01, 0.3, 0.5, 4.0, 5.0, 12.0, 15.0, 200.0])
LOAD = LoadDependence(coulomb=0.1, stribeck=0.05, viscous=0.002)

each_law = pytest.mark.parametrize("name", LAWS)


def by_direction(law: AbstractFrictionLaw, factor: float) -> AbstractFrictionLaw:
    """Return the law with every torque and slope `factor` times as large in negative motion."""
    scaled = {"tau_c", "tau_s", "viscous", "quadratic", "slopes", "sigma0", "sigma1", "sigma2"}
    changes: dict[str, object] = {}
    for item in dataclasses.fields(law):
        value = getattr(law, item.name)
        if item.name == "polyline":
            changes[item.name] = by_direction(value, factor)
        elif item.name == "slopes":
            changes[item.name] = tuple(Directional(entry, factor * entry) for entry in value)
        elif item.name in scaled:
            changes[item.name] = Directional(value, factor * value)
    return dataclasses.replace(law, **changes)


def test_the_table_holds_every_law() -> None:
    """Each built-in law is registered under its name and stands in the table of this module."""
    assert {type(law) for law, _ in LAWS.values()} == set(BUILT_IN)
    assert {law.name: law for law in BUILT_IN}.items() <= friction_laws().items()


@each_law
def test_magnitude_is_the_closed_form_on_floats_arrays_and_symbols(name: str) -> None:
    """One definition gives the closed form on floats, arrays and SX."""
    law, closed_form = LAWS[name]
    wanted = np.array([closed_form(speed) for speed in SPEEDS])
    flat = 0.2 * FLOOR_OF_POWER**0.7
    assert [float(law.magnitude(speed)) for speed in SPEEDS] == pytest.approx(wanted, rel=ROUNDING, abs=flat)
    assert law.magnitude(SPEEDS) == pytest.approx(wanted, rel=ROUNDING, abs=flat)
    speed = ca.SX.sym("speed")
    symbolic = ca.Function("magnitude", [speed], [law.magnitude(speed)])
    assert np.asarray(symbolic(SPEEDS[None, :])).ravel() == pytest.approx(law.magnitude(SPEEDS), rel=ROUNDING)


@each_law
def test_torque_is_odd_without_directions(name: str) -> None:
    """Without directional values the torque changes its sign with the speed, and never its size."""
    element = FrictionElement(LAWS[name][0], LOAD)
    for width in (0.0, 0.3):
        forward, backward = element.torque(SPEEDS, 1.5, width), element.torque(-SPEEDS, 1.5, width)
        assert backward == pytest.approx(-forward, rel=ROUNDING)


@each_law
def test_directions_are_laws_of_their_own(name: str) -> None:
    """With directional values each direction follows its own law, load included."""
    law = LAWS[name][0]
    load = LoadDependence(Directional(0.1, 0.2), Directional(0.05, 0.1), Directional(0.002, 0.004))
    both, single = FrictionElement(by_direction(law, 2.0), load), FrictionElement(law, LOAD)
    moving = SPEEDS[1:]
    assert both.torque(moving, 1.5) == pytest.approx(single.torque(moving, 1.5), rel=ROUNDING)
    assert both.torque(-moving, 1.5) == pytest.approx(-2.0 * single.torque(moving, 1.5), rel=ROUNDING)


@each_law
def test_friction_takes_energy_out(name: str) -> None:
    """The steady torque never pushes: torque times speed is not negative, smoothed or not, loaded or not."""
    element = FrictionElement(LAWS[name][0], LOAD)
    speeds = np.concatenate((-SPEEDS, SPEEDS))
    for width in (0.0, 0.3):
        assert np.all(element.torque(speeds, 2.0, width) * speeds >= 0.0)


@pytest.mark.parametrize(
    ("name", "breakaway"),
    [("none", 0), ("coulomb", 0.2), ("viscous", 0), ("stribeck", 0.3), ("polyline", 0.2), ("polyline through zero", 0)],
)
def test_breakaway_is_the_magnitude_at_standstill(name: str, breakaway: float) -> None:
    """A shaft at rest starts above the magnitude at zero speed, both ways, and the load adds its shares."""
    law = LAWS[name][0]
    element = FrictionElement(law, LOAD)
    omega = ca.SX.sym("omega")
    response = element.step_response(1e-3, omega, 0.0, 2.0)
    levels = ca.Function("levels", [omega], [ca.SX(response.upper), ca.SX(response.lower)])(0.0)
    shares = 0.0 if isinstance(law, NoFriction) else 2.0 * (0.1 + 0.05 * float(law.weakening(0.0)))
    assert float(law.magnitude(0.0)) == pytest.approx(breakaway, abs=0.1 * FLOOR_OF_POWER)
    assert [float(level) for level in levels] == pytest.approx([breakaway + shares] * 2, abs=0.1 * FLOOR_OF_POWER)


def test_load_adds_to_coulomb_stribeck_and_viscous_part() -> None:
    """Under the torque T a Stribeck law is that of tau_c + c T, Stribeck part + s T and viscous + v T."""
    element = FrictionElement(LAWS["stribeck"][0], LOAD)
    same = Stribeck(0.2 + 0.1 * 3.0, 0.3 + 0.15 * 3.0, 4.0, 0.01 + 0.002 * 3.0)
    assert element.magnitude("positive", SPEEDS, 3.0) == pytest.approx(same.magnitude(SPEEDS), rel=ROUNDING)


@pytest.mark.parametrize("delta", [0.5, 1.0, 1.7, 2.0])
def test_stribeck_has_finite_derivatives_at_standstill(delta: float) -> None:
    """Speed, exponent and every other number have a finite derivative at zero speed, for exponents below 1 too."""
    symbols = ca.SX.sym("p", 6)
    law = Stribeck(*(symbols[k] for k in range(1, 6)))
    slope = ca.Function("slope", [symbols], [ca.jacobian(law.magnitude(symbols[0]), symbols)])
    assert np.all(np.isfinite(np.asarray(slope([0.0, 0.2, 0.3, 4.0, 0.01, delta]))))


def test_a_polyline_slope_replaces_the_one_before() -> None:
    """Between its breaks the slope of a polyline is that segment's own, not the sum of those so far."""
    law = LAWS["polyline"][0]
    slopes = np.diff(law.magnitude(np.array([1.0, 2.0, 8.0, 9.0, 20.0, 21.0])))[::2]
    assert slopes == pytest.approx([0.02, 0.004, 0.01], rel=1e-12)


def test_a_polyline_through_zero_is_continuous() -> None:
    """`omega_zero` replaces the jump by the line from zero to the friction at that speed."""
    law = LAWS["polyline through zero"][0]
    below, at = law.magnitude(np.array([0.5 - 1e-12, 0.5]))
    assert law.magnitude(0.0) == 0.0 and law.magnitude(0.25) == pytest.approx(0.5 * at, rel=ROUNDING)
    assert below == pytest.approx(at, rel=1e-11)


@each_law
def test_every_number_of_a_law_has_a_path_and_a_meaning(name: str) -> None:
    """A law's numbers are named by field, direction and place, with the unit kind and a sentence."""
    law = by_direction(LAWS[name][0], 2.0)
    found = {leaf.path: leaf for leaf in leaves(FrictionElement(law, LOAD), "load.friction")}
    assert all(leaf.kind and leaf.meaning for leaf in found.values())
    assert "load.friction.load.coulomb" in found
    for item in dataclasses.fields(law):
        if getattr(law, item.name) is not None:
            assert any(path.startswith(f"load.friction.{item.name}") for path in found) or not getattr(law, item.name)
