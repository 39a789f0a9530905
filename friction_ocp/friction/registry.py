"""The friction laws by name: one line a law."""

from __future__ import annotations

from importlib.metadata import entry_points

from friction_ocp.friction.bristle import Dahl, LuGre
from friction_ocp.friction.gms import GeneralizedMaxwellSlip
from friction_ocp.friction.law import AbstractFrictionLaw
from friction_ocp.friction.polyline_hysteresis import PolylineHysteresis
from friction_ocp.friction.static import Coulomb, CoulombViscous, NoFriction, Polyline, Quadratic, Stribeck, Viscous

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


def friction_laws() -> dict[str, type[AbstractFrictionLaw]]:
    """Return all laws by name, those of installed packages (entry point `friction_ocp.laws`) included."""
    laws = {law.name: law for law in BUILT_IN}
    for point in entry_points(group="friction_ocp.laws"):
        law: type[AbstractFrictionLaw] = point.load()
        laws[law.name] = law
    return laws
