"""Generalised Maxwell slip: presliding of several springs under one Stribeck level."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from friction_ocp.friction.maxwell import AbstractMaxwellSlip, Spring
from friction_ocp.friction.static import stribeck_share
from friction_ocp.parameters import Value, quantity


@dataclass(frozen=True)
class MaxwellElement:
    """One spring that slips."""

    stiffness: Value = quantity("stiffness", "stiffness of an element")
    share: Value = quantity("dimensionless", "share of an element in the level of the friction")


@dataclass(frozen=True)
class GeneralizedMaxwellSlip(AbstractMaxwellSlip):
    r"""Maxwell slip with Stribeck weakening: springs k_j that slip at shares a_j of one level.

    .. math::
        \tau_f = \sum_j k_j z_j + \text{viscous}\,\omega, \qquad
        |k_j z_j| \le a_j \left(\tau_c + (\tau_s - \tau_c) e^{-(|\omega| / \omega_s)^\delta}\right)

    A spring that slips stays at its level. Source: Al-Bender, Lampaert, Swevers 2005, with instant attraction.
    """

    elements: tuple[MaxwellElement, ...]
    tau_c: Value = quantity("torque", "Coulomb friction")
    tau_s: Value = quantity("torque", "breakaway torque", nested="tau_c")
    omega_s: Value = quantity("speed", "Stribeck speed", nested="guess")
    viscous: Value = quantity("viscous", "viscous friction", 0.0)
    delta: Value = quantity("dimensionless", "Stribeck exponent", 2.0, nested="guess")
    name: ClassVar[str] = "gms"

    @property
    def deflections(self) -> tuple[str, ...]:
        count = len(self.elements)
        return tuple(f"z{k + 1 if count > 1 else ''}" for k in range(count))

    def springs(self, level: Any) -> tuple[Spring, ...]:
        return tuple(Spring(item.stiffness, item.share * level / item.stiffness) for item in self.elements)

    def weakening(self, speed: Any) -> Any:
        return stribeck_share(speed, self.omega_s, self.delta)

    def level(self, speed: Any) -> Any:
        return self.tau_c + (self.tau_s - self.tau_c) * self.weakening(speed)

    def drag(self, speed: Any) -> Any:
        return self.viscous * speed
