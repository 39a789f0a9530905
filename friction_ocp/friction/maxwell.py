"""Friction of springs that slip: each follows the travel until its torque reaches its share of the level.

Over a step of constant speed the mean torque of such a spring is a smooth, rising function of the travel, whatever
the length of the step; the integrator takes its tangent.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca

from friction_ocp.friction.law import AbstractFrictionLaw
from friction_ocp.friction.smoothing import positive_part, smooth_abs, where
from friction_ocp.parameters import Value, is_off, quantity

ROUNDING = 1e-2
"""Share of the travel before slip over which the form in continuous time lets a spring go."""

DEPTH = 10
"""Operations over which two expressions are compared."""

NO_TRAVEL = 1e-12
"""Share of the reach below which slip does not show; it keeps derivatives finite."""


@dataclass(frozen=True)
class Spring:
    """One spring in one direction: its stiffness and the deflection, counted positive, at which it slips."""

    stiffness: Any
    reach: Any


STIFFNESSES = (10.0**-0.5, 1.0, 10.0**0.5)
"""Stiffness of springs beside something that relaxes, over that of the middle one, were they to carry the same."""


@dataclass(frozen=True)
class SpringShares:
    """Springs that slip beside something that relaxes: what a contact of many asperities has more than one of these.

    What relaxes forgets a turning point gradually; springs come back to it, and over a decade of stiffnesses, half a
    decade apart, they follow any loop that does. Source: Iwan 1966; Al-Bender, Lampaert, Swevers 2005.
    """

    share: Value = quantity("dimensionless", "share of all that the springs carry")
    soft: Value = quantity("dimensionless", "what the soft spring carries, over the middle one")
    stiff: Value = quantity("dimensionless", "what the stiff spring carries, over the middle one")
    deflections: ClassVar[tuple[str, ...]] = ("z_soft", "z_middle", "z_stiff")

    @property
    def idle(self) -> bool:
        """Whether they plainly carry nothing."""
        return is_off(self.share)

    @property
    def rest(self) -> Any:
        """Share that the springs leave to what relaxes."""
        return 1.0 - self.share

    @property
    def shares(self) -> tuple[Any, ...]:
        """Share of each spring, the softest first."""
        middle = self.share / (self.soft + 1.0 + self.stiff)
        return self.soft * middle, middle, self.stiff * middle


@dataclass(frozen=True)
class AbstractMaxwellSlip(AbstractFrictionLaw):
    """Springs in parallel that slip at shares of `level`, beside a `drag` that vanishes at standstill."""

    has_bristle: ClassVar[bool] = True

    @abstractmethod
    def springs(self, level: Any) -> tuple[Spring, ...]:
        """Return the springs, each with a deflection of its own, under a level."""

    @abstractmethod
    def level(self, speed: Any) -> Any:
        """Return the torque at `speed` >= 0 of which each spring holds its share."""

    @abstractmethod
    def drag(self, speed: Any) -> Any:
        """Return the part of the torque at `speed` >= 0 that does not depend on the springs."""

    def magnitude(self, speed: Any) -> Any:
        held = sum(spring.stiffness * spring.reach for spring in self.springs(self.level(speed)))
        return held + self.drag(speed)


@dataclass(frozen=True)
class Play:
    """A spring between its two directions of slip."""

    forward: Spring
    backward: Spring

    @property
    def _even(self) -> bool:
        """Whether it is as stiff one way as the other, for all that expressions tell."""
        one, other = ca.SX(self.forward.stiffness), ca.SX(self.backward.stiffness)
        return bool(ca.is_equal(one, other, DEPTH))

    def held(self, deflection: Any) -> Any:
        """Return the part of a deflection that the level can hold."""
        return ca.fmin(ca.fmax(ca.SX(deflection), -self.backward.reach), self.forward.reach)

    def after(self, deflection: Any, travel: Any) -> Any:
        """Return the deflection after a travel."""
        begin = self.held(deflection)
        return begin + self._sticking(begin, travel)

    def _room(self, begin: Any, travel: Any) -> Any:
        """Return the size of the travel in its direction after which the spring slips."""
        return positive_part(where(travel >= 0, self.forward.reach - begin, self.backward.reach + begin))

    def _sticking(self, begin: Any, travel: Any) -> Any:
        """Return the part of a travel over which the spring does not slip."""
        room = self._room(begin, travel)
        return where(travel >= 0, ca.fmin(travel, room), -ca.fmin(-travel, room))

    def mean_torque(self, deflection: Any, travel: Any) -> Any:
        """Return the mean torque over a travel at constant speed."""
        begin = self.held(deflection)
        room, size = self._room(begin, travel), smooth_abs(travel)
        slips = size > room + NO_TRAVEL * (self.forward.reach + self.backward.reach)
        stuck = where(slips, room / where(slips, size, 1.0), 1.0)
        slipping = self.elastic(where(travel >= 0, self.forward.reach, -self.backward.reach))
        return stuck * self._mean_elastic(begin, begin + self._sticking(begin, travel)) + (1.0 - stuck) * slipping

    def _mean_elastic(self, begin: Any, end: Any) -> Any:
        """Return the mean torque while the deflection grows evenly from `begin` to `end`."""
        if self._even:
            return self.forward.stiffness * (0.5 * (begin + end))
        crosses = begin * end < 0
        share = where(crosses, smooth_abs(begin) / where(crosses, smooth_abs(end - begin), 1.0), 0.0)
        first, last = self.elastic(begin), self.elastic(end)
        return 0.5 * where(crosses, share * first + (1.0 - share) * last, first + last)

    def elastic(self, deflection: Any) -> Any:
        """Return the torque of a deflection."""
        if self._even:
            return self.forward.stiffness * deflection
        return where(deflection >= 0, self.forward.stiffness, self.backward.stiffness) * deflection

    def torque_and_rate(self, omega: Any, deflection: Any) -> tuple[Any, Any]:
        """Return the torque and the rate of the deflection in continuous time, its slip rounded over `ROUNDING`.

        Source of the rounding: Dupont, Hayward, Armstrong, Altpeter 2002 (elasto-plastic friction).
        """
        reach = where(omega >= 0, self.forward.reach, self.backward.reach)
        used = smooth_abs(deflection) / reach
        slipping = where(omega * deflection > 0, positive_part((used - 1.0 + ROUNDING) / ROUNDING), 0.0)
        return self.elastic(deflection), omega - slipping * omega * used
