"""Friction laws with an elastic bristle whose deflection is a state."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

from friction_ocp.friction.law import AbstractFrictionLaw
from friction_ocp.friction.maxwell import Spring
from friction_ocp.friction.static import stribeck_share
from friction_ocp.parameters import Value, quantity


@dataclass(frozen=True)
class AbstractBristleLaw(AbstractFrictionLaw):
    """A law with sigma0, sigma1 and sigma2: stiffness and damping of its bristle, and viscous friction."""

    has_bristle: ClassVar[bool] = True

    @abstractmethod
    def level(self, speed: Any) -> Any:
        """Return the torque of the fully deflected bristle."""

    @property
    def carried(self) -> Any:
        """Share of the level that the bristle carries; the springs beside it carry the rest."""
        return 1.0

    def springs(self, level: Any) -> tuple[Spring, ...]:
        """Return the springs that slip beside the bristle, under a level."""
        return ()

    def magnitude(self, speed: Any) -> Any:
        viscous: Any = getattr(self, "sigma2")  # noqa: B009
        return self.level(speed) + viscous * speed


@dataclass(frozen=True)
class LuGre(AbstractBristleLaw):
    r"""LuGre friction: bristle deflection z with Stribeck weakening.

    .. math::
        \dot z = \omega - \frac{\sigma_0 |\omega|}{g(\omega)} z, \qquad
        \tau_f = \sigma_0 z + \sigma_1 \dot z + \sigma_2 \omega, \qquad
        g = \tau_c + (\tau_s - \tau_c) e^{-(|\omega| / \omega_s)^\delta}

    With directional values sigma0 and sigma1 follow the sign of z, g and sigma2 the sign of omega.

    Source: Canudas de Wit et al. 1995; in the form of Kumar & Banavar 2011, eqs. 2-4.
    """

    tau_c: Value = quantity("torque", "Coulomb friction")
    tau_s: Value = quantity("torque", "breakaway torque", nested="tau_c")
    omega_s: Value = quantity("speed", "Stribeck speed", nested="guess")
    sigma0: Value = quantity("stiffness", "bristle stiffness")
    sigma1: Value = quantity("damping", "bristle damping", 0.0)
    sigma2: Value = quantity("viscous", "viscous friction", 0.0)
    delta: Value = quantity("dimensionless", "Stribeck exponent", 2.0, nested="guess")
    name: ClassVar[str] = "lugre"

    def weakening(self, speed: Any) -> Any:
        return stribeck_share(speed, self.omega_s, self.delta)

    def level(self, speed: Any) -> Any:
        """Return g(speed), the torque of the fully deflected bristle."""
        return self.tau_c + (self.tau_s - self.tau_c) * self.weakening(speed)


@dataclass(frozen=True)
class Dahl(AbstractBristleLaw):
    r"""Dahl friction: a bristle without weakening or damping.

    .. math:: \dot z = \omega - \frac{\sigma_0 |\omega|}{\tau_c} z, \qquad \tau_f = \sigma_0 z + \sigma_2 \omega

    Source: Dahl 1968, with exponent 1.
    """

    tau_c: Value = quantity("torque", "Coulomb friction")
    sigma0: Value = quantity("stiffness", "bristle stiffness")
    sigma2: Value = quantity("viscous", "viscous friction", 0.0)
    name: ClassVar[str] = "dahl"
    sigma1: ClassVar[float] = 0.0

    def level(self, speed: Any) -> Any:
        """Return the torque of the fully deflected bristle."""
        return self.tau_c + 0.0 * speed
