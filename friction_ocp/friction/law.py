"""What a friction law is, and its one sign convention.

Friction torque opposes the speed and is subtracted in the equation of motion:
J domega/dt = tau_applied - tau_friction. A law states the magnitude of that torque at speeds >= 0, once;
directions, load and set-valuedness at standstill are added around it.
"""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, Self

from friction_ocp.parameters import Directional

Direction = Literal["positive", "negative"]


def _toward(value: Any, direction: Direction) -> Any:
    if isinstance(value, Directional):
        return value.positive if direction == "positive" else value.negative
    if isinstance(value, tuple):
        return tuple(_toward(item, direction) for item in value)  # pyright: ignore[reportUnknownVariableType]
    return value


def toward(part: Any, direction: Direction) -> Any:
    """Return a law, or a part of one, without directional values."""
    changes: dict[str, Any] = {}
    for item in dataclasses.fields(part):
        value = getattr(part, item.name)
        if "kind" in item.metadata:
            changes[item.name] = _toward(value, direction)
        elif isinstance(value, tuple):
            changes[item.name] = tuple(toward(one, direction) for one in value)  # pyright: ignore[reportUnknownVariableType]
        elif dataclasses.is_dataclass(value):
            changes[item.name] = toward(value, direction)
    return dataclasses.replace(part, **changes)


def times(value: Any, factor: Any) -> Any:
    """Return a number of friction, whatever its form, times a factor."""
    if isinstance(value, Directional):
        return Directional(value.positive * factor, value.negative * factor)
    if isinstance(value, tuple):
        return tuple(times(item, factor) for item in value)  # pyright: ignore[reportUnknownVariableType]
    return None if value is None else value * factor


def _part_times(part: Any, factors: Mapping[str, Any]) -> Any:
    """Return a law, or a part of one, with its numbers times the factors of their kinds."""
    changes: dict[str, Any] = {}
    for item in dataclasses.fields(part):
        value = getattr(part, item.name)
        if "kind" in item.metadata:
            changes[item.name] = times(value, factors.get(item.metadata["kind"], 1.0))
        elif isinstance(value, tuple):
            changes[item.name] = tuple(_part_times(one, factors) for one in value)  # pyright: ignore[reportUnknownVariableType]
        elif dataclasses.is_dataclass(value):
            changes[item.name] = _part_times(value, factors)
    return dataclasses.replace(part, **changes)


@dataclass(frozen=True)
class AbstractFrictionLaw(ABC):
    """Friction torque of a shaft as a function of its speed (and of a bristle state)."""

    name: ClassVar[str]
    has_bristle: ClassVar[bool] = False

    @property
    def deflections(self) -> tuple[str, ...]:
        """Names of the deflections that are states."""
        return ("z",) if self.has_bristle else ()

    @abstractmethod
    def magnitude(self, speed: Any) -> Any:
        """Return the steady-state torque magnitude at `speed` >= 0; its value at 0 is the breakaway torque."""

    def weakening(self, speed: Any) -> Any:
        """Return the Stribeck share at `speed` >= 0: 1 at standstill, 0 far above the Stribeck speed."""
        return 0.0 * speed

    def scaled(self, level: Any, viscous: Any) -> Self:
        """Return the law with its dry friction times `level` and its lubricant drag times `viscous`.

        Numbers that are torques count as dry friction, those per speed or its square as drag.
        """
        return _part_times(self, {"torque": level, "viscous": viscous, "quadratic": viscous})

    def along(self, direction: Direction) -> Self:
        """Return the law of one direction of motion, without directional values."""
        return toward(self, direction)
