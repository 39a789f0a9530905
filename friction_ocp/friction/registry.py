"""The friction laws by name: one line a law."""

from __future__ import annotations

from importlib.metadata import entry_points
from typing import TypeVar

from friction_ocp.friction.bristle import Dahl, LuGre
from friction_ocp.friction.gms import GeneralizedMaxwellSlip
from friction_ocp.friction.law import AbstractFrictionLaw
from friction_ocp.friction.polyline_hysteresis import PolylineHysteresis
from friction_ocp.friction.static import Coulomb, CoulombViscous, NoFriction, Polyline, Quadratic, Stribeck, Viscous

Law = TypeVar("Law", bound=type[AbstractFrictionLaw])

BUILT_IN: tuple[type[AbstractFrictionLaw], ...] = (
    NoFriction,
    Coulomb,
    Viscous,
    CoulombViscous,
    Stribeck,
    Polyline,
    Quadratic,
    Dahl,
    LuGre,
    GeneralizedMaxwellSlip,
    PolylineHysteresis,
)


_registered: dict[str, type[AbstractFrictionLaw]] = {}
"""Laws that this process has made known, by name."""


def register_law(law: Law) -> Law:
    """Make a law known to problem files in this process, and return it: usable as a decorator.

    Other processes know the laws of installed packages alone.
    """
    _registered[law.name] = law
    return law


def friction_laws() -> dict[str, type[AbstractFrictionLaw]]:
    """Return all laws by name, those of installed packages (entry point `friction_ocp.laws`) included."""
    laws = {law.name: law for law in (*BUILT_IN, *_registered.values())}
    for point in entry_points(group="friction_ocp.laws"):
        law: type[AbstractFrictionLaw] = point.load()
        laws[law.name] = law
    return laws
