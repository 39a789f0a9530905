"""The catalogue of effects: one line an effect."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from importlib.metadata import entry_points
from typing import TypeVar

from friction_ocp.drive.parts import Drive
from friction_ocp.effects.effect import AbstractEffect
from friction_ocp.effects.friction_curve import (
    AsymmetryEffect,
    FrictionEffect,
    PolylineBreakEffect,
    QuadraticDragEffect,
    StribeckEffect,
)
from friction_ocp.effects.friction_state import LoadDependenceEffect, PreslidingEffect
from friction_ocp.effects.friction_time import WarmUpEffect
from friction_ocp.effects.joints import (
    BacklashEffect,
    ComplianceEffect,
    KinematicErrorEffect,
    StiffeningEffect,
    TransmissionHysteresisEffect,
)
from friction_ocp.effects.motor import DriveLagEffect, TorqueSaturationEffect
from friction_ocp.effects.periodic import (
    CoggingEffect,
    PeriodicDisturbanceEffect,
    PositionRippleEffect,
    SensorEccentricityEffect,
    TorqueRippleEffect,
)
from friction_ocp.effects.sensors import SensorDelayEffect, SensorGainEffect, SensorOffsetEffect
from friction_ocp.effects.stated_values import InertiaErrorEffect, ParameterErrorEffect
from friction_ocp.effects.torques import ConstantTorqueEffect, StructuralModeEffect, UnbalanceEffect

Effect = TypeVar("Effect", bound=type[AbstractEffect])

BUILT_IN: tuple[type[AbstractEffect], ...] = (
    FrictionEffect,
    StribeckEffect,
    PolylineBreakEffect,
    QuadraticDragEffect,
    AsymmetryEffect,
    PreslidingEffect,
    LoadDependenceEffect,
    PositionRippleEffect,
    WarmUpEffect,
    CoggingEffect,
    TorqueRippleEffect,
    DriveLagEffect,
    TorqueSaturationEffect,
    BacklashEffect,
    ComplianceEffect,
    StiffeningEffect,
    TransmissionHysteresisEffect,
    KinematicErrorEffect,
    UnbalanceEffect,
    ConstantTorqueEffect,
    PeriodicDisturbanceEffect,
    StructuralModeEffect,
    InertiaErrorEffect,
    ParameterErrorEffect,
    SensorOffsetEffect,
    SensorGainEffect,
    SensorDelayEffect,
    SensorEccentricityEffect,
)


_registered: dict[str, type[AbstractEffect]] = {}
"""Effects that this process has made known, by name."""


def register_effect(effect: Effect) -> Effect:
    """Let an effect compete with the catalogue in this process, and return it: usable as a decorator.

    Other processes know the effects of installed packages alone.
    """
    _registered[effect.name] = effect
    return effect


def effects() -> dict[str, AbstractEffect]:
    """Return all effects by name, those of installed packages (entry point `friction_ocp.effects`) included."""
    known = {kind.name: kind() for kind in (*BUILT_IN, *_registered.values())}
    return known | {kind.name: kind() for kind in _installed()}


@cache
def _installed() -> tuple[type[AbstractEffect], ...]:
    return tuple(point.load() for point in entry_points(group="friction_ocp.effects"))


def candidates(drive: Drive, names: list[str]) -> Iterator[tuple[AbstractEffect, str]]:
    """Yield every effect of these names at every place of a drive where it makes sense."""
    catalogue = effects()
    for name in names:
        for place in catalogue[name].places(drive):
            yield catalogue[name], place
