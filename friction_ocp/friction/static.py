"""Friction laws that are functions of the speed alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from friction_ocp.friction.law import AbstractFrictionLaw
from friction_ocp.friction.smoothing import exp, log1p_mean, positive_part, power, where
from friction_ocp.parameters import Value, quantity


@dataclass(frozen=True)
class NoFriction(AbstractFrictionLaw):
    """A shaft that turns freely."""

    name: ClassVar[str] = "none"

    def magnitude(self, speed: Any) -> Any:
        return 0.0 * speed


@dataclass(frozen=True)
class Coulomb(AbstractFrictionLaw):
    """Dry friction, independent of the speed."""

    tau_c: Value = quantity("torque", "Coulomb friction")
    name: ClassVar[str] = "coulomb"

    def magnitude(self, speed: Any) -> Any:
        return self.tau_c + 0.0 * speed


@dataclass(frozen=True)
class Viscous(AbstractFrictionLaw):
    """Friction proportional to the speed."""

    viscous: Value = quantity("viscous", "viscous friction")
    name: ClassVar[str] = "viscous"

    def magnitude(self, speed: Any) -> Any:
        return self.viscous * speed


@dataclass(frozen=True)
class CoulombViscous(AbstractFrictionLaw):
    """Dry friction and friction proportional to the speed."""

    tau_c: Value = quantity("torque", "Coulomb friction")
    viscous: Value = quantity("viscous", "viscous friction")
    name: ClassVar[str] = "coulomb_viscous"

    def magnitude(self, speed: Any) -> Any:
        return self.tau_c + self.viscous * speed


def stribeck_share(speed: Any, omega_s: Any, delta: Any, tail: Any = None) -> Any:
    """Return (1 + tail s)^(-1 / tail) of s = (speed / omega_s)^delta, exp(-s) without a tail.

    With finite derivatives at standstill for delta < 1.
    """
    fall = power(speed / omega_s, delta)
    return exp(-fall if tail is None else -fall * log1p_mean(tail * fall))


@dataclass(frozen=True)
class Stribeck(AbstractFrictionLaw):
    r"""Friction that falls with the speed near standstill.

    .. math:: \tau_c + (\tau_s - \tau_c) e^{-(|\omega| / \omega_s)^\delta} + \text{viscous} |\omega|

    Source: Armstrong-Helouvry, Dupont, Canudas de Wit 1994; with free exponent in Kumar & Banavar 2011, eq. 4.
    """

    tau_c: Value = quantity("torque", "Coulomb friction")
    tau_s: Value = quantity("torque", "breakaway torque", nested="tau_c")
    omega_s: Value = quantity("speed", "Stribeck speed", nested="guess")
    viscous: Value = quantity("viscous", "viscous friction", 0.0)
    delta: Value = quantity("dimensionless", "Stribeck exponent", 2.0, nested="guess")
    name: ClassVar[str] = "stribeck"

    def weakening(self, speed: Any) -> Any:
        return stribeck_share(speed, self.omega_s, self.delta)

    def magnitude(self, speed: Any) -> Any:
        return self.tau_c + (self.tau_s - self.tau_c) * self.weakening(speed) + self.viscous * speed


@dataclass(frozen=True)
class Quadratic(AbstractFrictionLaw):
    """Friction that curves with the speed.

    Source: Leighton telescope paper, eq. 14.
    """

    tau_c: Value = quantity("torque", "Coulomb friction")
    viscous: Value = quantity("viscous", "viscous friction")
    quadratic: Value = quantity("quadratic", "quadratic friction", nested=0.0)
    name: ClassVar[str] = "quadratic"

    def magnitude(self, speed: Any) -> Any:
        return self.tau_c + (self.viscous + self.quadratic * speed) * speed


@dataclass(frozen=True)
class Polyline(AbstractFrictionLaw):
    """Friction of straight segments over the speed, k slopes and k - 1 break speeds.

    With `omega_zero` a line through zero replaces the jump at standstill.

    Source: Leighton telescope paper, eqs. 5, 6 (slope after a break replaces the one before) and Fig. 6b.
    """

    tau_c: Value = quantity("torque", "Coulomb friction")
    slopes: tuple[Value, ...] = quantity("viscous", "slope of a segment", nested="first")
    breaks: tuple[Value, ...] = quantity("speed", "speed at which the slope changes", (), nested="guess")
    omega_zero: Value = quantity("speed", "speed below which the friction is a line through zero", None)
    name: ClassVar[str] = "polyline"

    def magnitude(self, speed: Any) -> Any:
        torque = self.line(speed)
        if self.omega_zero is None:
            return torque
        through_zero = speed * self.line(self.omega_zero) / self.omega_zero
        return where(speed < self.omega_zero, through_zero, torque)

    def line(self, speed: Any) -> Any:
        """Return the torque of the segments at `speed` >= 0, whatever replaces them near standstill."""
        torque = self.tau_c + self.slopes[0] * speed
        for before, after, knee in zip(self.slopes, self.slopes[1:], self.breaks, strict=False):
            torque = torque + (after - before) * positive_part(speed - knee)
        return torque
