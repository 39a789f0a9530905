"""A friction law at its place on a shaft: directions, load dependence, and its response over one step.

Over a step of length h every law reduces to
    torque = offset + slope * mean speed + a set-valued part in [-lower, upper],
the form in which the integrator solves for the new speed in closed form.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import casadi as ca

from friction_ocp.friction.bristle import AbstractBristleLaw
from friction_ocp.friction.law import AbstractFrictionLaw, Direction, times
from friction_ocp.friction.maxwell import AbstractMaxwellSlip, Play
from friction_ocp.friction.modifiers import Ripple, Surroundings, WarmUp
from friction_ocp.friction.smoothing import decay_means, positive_part, smooth_abs, smooth_sign, where
from friction_ocp.friction.static import NoFriction, stribeck_share
from friction_ocp.parameters import Directional, Value, inline, quantity

EXPONENT = 2.0
"""Of Stribeck friction that grows with the load at a speed of its own."""


@dataclass(frozen=True)
class LoadDependence:
    """Friction that grows with the torque transmitted by the shaft; each is a share of that torque.

    Source: Gautier & Jubien 2014; Duclusaud et al. 2025 (load-dependent Coulomb and Stribeck friction of servos).
    """

    coulomb: Value = quantity("dimensionless", "Coulomb friction per transmitted torque", 0.0)
    stribeck: Value = quantity("dimensionless", "Stribeck friction per transmitted torque", 0.0, nested=0.0)
    viscous: Value = quantity("load_viscous", "viscous friction per transmitted torque", 0.0)
    omega_s: Value = quantity("speed", "Stribeck speed of what grows with the torque", None, nested="guess")
    """None is that of the law, with its exponent; beside a speed of its own the exponent is 2."""

    def scaled(self, level: Any, viscous: Any) -> LoadDependence:
        """Return the shares with those of dry friction times `level` and that of the drag times `viscous`."""
        factors = {"coulomb": level, "stribeck": level, "viscous": viscous}
        return replace(self, **{name: times(getattr(self, name), factor) for name, factor in factors.items()})

    def along(self, direction: Direction) -> LoadDependence:
        """Return the shares of one direction of motion."""

        def pick(value: Value) -> Value:
            return getattr(value, direction) if isinstance(value, Directional) else value

        return LoadDependence(pick(self.coulomb), pick(self.stribeck), pick(self.viscous), pick(self.omega_s))

    def share(self, law: AbstractFrictionLaw, speed: Any) -> Any:
        """Return dry friction per transmitted torque at `speed` >= 0, on a shaft with a law."""
        falling = law.weakening(speed) if self.omega_s is None else stribeck_share(speed, self.omega_s, EXPONENT)
        return self.coulomb + self.stribeck * falling


def _stacked(items: list[Any]) -> Any:
    """Return several deflections, or what belongs to them, as a column; one as it is."""
    return items[0] if len(items) == 1 else ca.vertcat(*[ca.SX(item) for item in items])


LEAST_REACH = 1e-12
"""Deflection at breakaway, rad or m, below which there is no friction: what divides by it has a value all the same."""

Slipping = AbstractBristleLaw | AbstractMaxwellSlip
"""Laws that may have springs that slip."""


@dataclass(frozen=True)
class StepResponse:
    """Torque of a friction element over one step: offset + slope * mean speed + [-lower, upper]."""

    offset: Any
    slope: Any
    upper: Any
    lower: Any


@dataclass(frozen=True)
class FrictionElement:
    """One law on one shaft, its values bound to numbers or SX."""

    law: AbstractFrictionLaw = inline()
    load: LoadDependence | None = None
    ripple: Ripple | None = None
    warm_up: WarmUp | None = None

    def under(self, surroundings: Surroundings) -> FrictionElement:
        """Return the friction at an angle, time and temperature, as a function of speed and load alone."""
        if self.ripple is None and self.warm_up is None:
            return self
        level: Any = 1.0
        viscous: Any = 1.0
        if self.ripple is not None:
            level = positive_part(1.0 + self.ripple.value(surroundings.theta, surroundings.passed))
        if self.warm_up is not None:
            dry, viscous = map(positive_part, self.warm_up.factors(surroundings))
            level = level * dry
        load = None if self.load is None else self.load.scaled(level, viscous)
        return FrictionElement(self.law.scaled(level, viscous), load)

    def magnitude(self, direction: Direction, speed: Any, transmitted: Any) -> Any:
        """Return the steady-state torque at `speed` >= 0 under the torque |transmitted|."""
        law = self.law.along(direction)
        return law.magnitude(speed) + self._load_level(direction, speed, transmitted, with_viscous=True)

    def _load_level(self, direction: Direction, speed: Any, transmitted: Any, with_viscous: bool) -> Any:
        if self.load is None:
            return 0.0
        load, law = self.load.along(direction), self.law.along(direction)
        share = load.share(law, speed)
        return transmitted * (share + load.viscous * speed if with_viscous else share)

    def torque(self, omega: Any, transmitted: Any = 0.0, width: Any = 0.0) -> Any:
        """Return the steady-state friction torque at the signed speed `omega`, its jump rounded over `width`.

        The speed is rounded as the sign is: drag keeps its slope at standstill.
        """
        speed = smooth_abs(omega, width)
        positive, negative = (self.magnitude(side, speed, transmitted) for side in ("positive", "negative"))
        return smooth_sign(omega, width) * where(omega >= 0, positive, negative)

    def forgetting_rate(self, omega: Any, deflection: Any, transmitted: Any) -> Any:
        """Return sigma0 |omega| / g(omega), the rate at which the bristle forgets its deflection.

        Without friction, g = 0, it does so within LEAST_REACH.
        """
        speed, stiffness = smooth_abs(omega), self._sigma(0, deflection)
        levels = [
            law.level(speed) + self._load_level(side, speed, transmitted, with_viscous=False)
            for side, law in self._bristles()
        ]
        level, least = where(omega >= 0, levels[0], levels[1]), LEAST_REACH * stiffness
        return stiffness * speed / where(level > least, level, least)

    def _bristles(self) -> list[tuple[Direction, AbstractBristleLaw]]:
        sides: list[tuple[Direction, AbstractBristleLaw]] = []
        for side in ("positive", "negative"):
            law = self.law.along(side)
            assert isinstance(law, AbstractBristleLaw)
            sides.append((side, law))
        return sides

    def _sigma(self, order: int, sign_of: Any) -> Any:
        (_, positive), (_, negative) = self._bristles()
        return where(sign_of >= 0, getattr(positive, f"sigma{order}"), getattr(negative, f"sigma{order}"))

    def bristle_torque(self, omega: Any, deflection: Any, transmitted: Any = 0.0) -> tuple[Any, Any]:
        """Return the torque of a bristle law and the rate of change of its deflection, or of its deflections."""
        (z, others), rates = self._apart(deflection), list[Any]()
        torque = self._drag(omega, transmitted)
        if z is not None:
            sigma0, sigma1 = self._carried(z)
            rates.append(omega - self.forgetting_rate(omega, z, transmitted) * z)
            torque = torque + sigma0 * z + sigma1 * rates[0]
        for item, one in zip(self._plays(omega, transmitted), others, strict=True):
            elastic, rate = item.torque_and_rate(omega, one)
            torque = torque + elastic
            rates.append(rate)
        return torque, _stacked(rates)

    def _apart(self, deflection: Any) -> tuple[Any, list[Any]]:
        """Return the deflection of the bristle, None where there is none, and those of springs that slip."""
        count = len(self.law.deflections)
        each = [deflection] if count == 1 else [deflection[k] for k in range(count)]
        return (None, each) if isinstance(self.law, AbstractMaxwellSlip) else (each[0], each[1:])

    def _carried(self, sign_of: Any) -> tuple[Any, Any]:
        """Return stiffness and damping of the bristle by the share of the level that it carries."""
        sigma0, sigma1 = self._sigma(0, sign_of), self._sigma(1, sign_of)
        if len(self.law.deflections) == 1:
            return sigma0, sigma1
        (_, positive), (_, negative) = self._bristles()
        share = where(sign_of >= 0, positive.carried, negative.carried)
        return share * sigma0, share * sigma1

    def _viscous(self, omega: Any, transmitted: Any) -> Any:
        viscous = self._sigma(2, omega)
        if self.load is None:
            return viscous
        sides = [self.load.along(side).viscous for side in ("positive", "negative")]
        return viscous + transmitted * where(omega >= 0, sides[0], sides[1])

    def sticking_deflection(self, omega: Any, torque: Any, inertia: Any) -> tuple[Any, Any]:
        """Return the deflection at which one bristle holds a torque at a speed near rest, and how far that can be.

        From `torque` = sigma0 z + sigma1 (omega - sigma0 |omega| z / g) + sigma2 omega, z within its reach at rest. The
        second number falls from 1 at rest to 0 where the bristle forgets its deflection as fast as `inertia` swings on
        it, sigma0 |omega| / g = sqrt(sigma0 / inertia), or slip takes half of the damping's share away.
        """
        (_, positive), (_, negative) = self._bristles()
        stiffness, damping = self._sigma(0, torque), self._sigma(1, torque)
        reach = where(torque >= 0, positive.level(0.0), negative.level(0.0)) / stiffness
        rate = self.forgetting_rate(omega, torque, 0.0)
        slip, pace = damping * rate / stiffness, rate * (inertia / stiffness) ** 0.5
        kept = where(slip <= 0.5, 1.0 - 2.0 * slip, 0.0) * where(pace <= 1.0, 1.0 - pace, 0.0)
        share = where(slip <= 0.5, 1.0 - slip, 0.5)
        balance = (torque - (damping + self._sigma(2, omega)) * omega) / (stiffness * share)
        return where(balance > reach, reach, where(balance < -reach, -reach, balance)), kept

    def steady_deflection(self, omega: Any) -> Any:
        """Return the deflection, or those of several bristles, that belongs to steady motion at `omega`."""
        return smooth_sign(omega, 0.0) * self._bent(omega)

    def _bent(self, omega: Any) -> Any:
        """Return the size of steady deflections in the direction of `omega`."""
        reaches = [where(omega >= 0, item.forward.reach, item.backward.reach) for item in self._plays(omega, 0.0)]
        if isinstance(self.law, AbstractMaxwellSlip):
            return _stacked(reaches)
        (_, positive), (_, negative) = self._bristles()
        level = where(omega >= 0, positive.level(smooth_abs(omega)), negative.level(smooth_abs(omega)))
        return _stacked([level / self._sigma(0, omega), *reaches])

    def step_response(self, h: Any, omega: ca.SX, deflection: Any, transmitted: Any) -> StepResponse:
        """Return the response over a step of `h` s that begins at speed `omega` (an SX symbol)."""
        if isinstance(self.law, NoFriction):
            return StepResponse(0.0, 0.0, 0.0, 0.0)
        if self.law.has_bristle:
            return self._deflected_response(h, omega, deflection, transmitted)
        return self._static_response(omega, transmitted)

    def _static_response(self, omega: ca.SX, transmitted: Any) -> StepResponse:
        levels: list[Any] = []
        slopes: list[Any] = []
        sides: tuple[tuple[Direction, float], ...] = (("positive", 1.0), ("negative", -1.0))
        for side, sign in sides:
            speed = ca.SX.sym("speed")
            level = ca.SX(self.magnitude(side, speed, transmitted))
            slope = ca.jacobian(level, speed)
            now = positive_part(sign * omega)
            level, slope = (ca.substitute(term, speed, now) for term in (level, slope))
            slopes.append(where(sign * omega >= 0, slope, 0.0))
            levels.append(level - slopes[-1] * now)
        slope = where(omega >= 0, slopes[0], slopes[1])
        return StepResponse(0.0, slope, levels[0], levels[1])

    def _deflected_response(self, h: Any, omega: ca.SX, deflection: Any, transmitted: Any) -> StepResponse:
        """Return the response of a bristle and of springs that slip; theirs is linearised at the speed `omega`."""
        z, others = self._apart(deflection)
        mean, torque = ca.SX.sym("mean"), ca.SX(0.0)
        for item, one in zip(self._plays(omega, transmitted), others, strict=True):
            torque = torque + item.mean_torque(one, h * mean)
        if z is None:
            torque = torque + self._drag(mean, transmitted)
        slope = ca.substitute(ca.jacobian(torque, mean), mean, omega)
        offset = ca.substitute(torque, mean, omega) - slope * omega
        if z is not None:
            sigma0, sigma1 = self._carried(z)
            rate = self.forgetting_rate(omega, z, transmitted)
            kept, added = decay_means(h * rate)
            offset = offset + (sigma0 - sigma1 * rate) * kept * z
            slope = slope + sigma0 * h * added + sigma1 * kept + self._viscous(omega, transmitted)
        return StepResponse(offset, slope, 0.0, 0.0)

    def advance(self, h: Any, omega: Any, mean_omega: Any, deflection: Any, transmitted: Any) -> Any:
        """Return the deflection after a step at constant speed, exact but for the level frozen at `omega`."""
        z, others = self._apart(deflection)
        plays = zip(self._plays(omega, transmitted), others, strict=True)
        slipped = [item.after(one, h * mean_omega) for item, one in plays]
        if z is None:
            return _stacked(slipped)
        rate = self.forgetting_rate(omega, z, transmitted)
        kept, _ = decay_means(h * rate)
        return _stacked([z + h * kept * (mean_omega - rate * z), *slipped])

    def _plays(self, omega: Any, transmitted: Any) -> list[Play]:
        """Return the springs of a law between the levels of both directions at the speed `omega`."""
        positive, negative = self.law.along("positive"), self.law.along("negative")
        assert isinstance(positive, Slipping) and isinstance(negative, Slipping)
        speed = smooth_abs(omega)
        loads = [self._load_level(side, speed, transmitted, with_viscous=False) for side in ("positive", "negative")]
        springs = (
            positive.springs(positive.level(speed) + loads[0]),
            negative.springs(negative.level(speed) + loads[1]),
        )
        return [Play(*pair) for pair in zip(*springs, strict=True)]

    def _drag(self, omega: Any, transmitted: Any) -> Any:
        """Return the signed part of the torque that depends on the speed alone, straight on both sides of standstill.

        The integrator takes its slope there, and an estimator the slope of that.
        """
        if isinstance(self.law, AbstractBristleLaw):
            return self._viscous(omega, transmitted) * omega
        torques: list[Any] = []
        sides: tuple[tuple[Direction, float], ...] = (("positive", 1.0), ("negative", -1.0))
        for side, sign in sides:
            law, speed = self.law.along(side), positive_part(sign * omega)
            assert isinstance(law, AbstractMaxwellSlip)
            viscous = 0.0 if self.load is None else transmitted * self.load.along(side).viscous
            torques.append(law.drag(speed) + viscous * speed)
        return where(omega >= 0, torques[0], -torques[1])
