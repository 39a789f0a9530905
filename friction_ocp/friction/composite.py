"""Friction laws put together: any law with further terms, any static law under a bristle."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar, TypeVar

from friction_ocp.friction.bristle import AbstractBristleLaw
from friction_ocp.friction.law import AbstractFrictionLaw
from friction_ocp.friction.maxwell import STIFFNESSES, Spring, SpringShares
from friction_ocp.friction.smoothing import positive_part
from friction_ocp.friction.static import stribeck_share
from friction_ocp.parameters import Value, inline, quantity

Law = TypeVar("Law", bound=AbstractFrictionLaw)

SHARES = {"omega_s": "speed_share", "sigma0": "stiffness_share", "sigma1": "damping_share"}
"""By number of a law, or of its bristle, what it may be larger by."""


@dataclass(frozen=True)
class StribeckRise:
    r"""Extra friction near standstill, which falls as an exponential or, with a tail, as slowly as a power.

    .. math:: \text{torque} \, (1 + \text{tail} \, s)^{-1 / \text{tail}}, \quad s = (|\omega| / \omega_s)^\delta

    Without a tail that is :math:`\text{torque} \, e^{-s}`; with a tail of 1 and an exponent of 2 it is the curve of
    Hess & Soom 1990.
    """

    torque: Value = quantity("torque", "extra friction at standstill", nested=0.0)
    omega_s: Value = quantity("speed", "Stribeck speed", nested="guess")
    delta: Value = quantity("dimensionless", "Stribeck exponent", 2.0, nested="guess")
    tail: Value = quantity("dimensionless", "how slowly the Stribeck curve ends", None, nested="guess")

    def torque_at(self, speed: Any) -> Any:
        """Return the torque at `speed` >= 0."""
        return self.torque * stribeck_share(speed, self.omega_s, self.delta, self.tail)


@dataclass(frozen=True)
class Bend:
    """A change of the viscous slope at a speed."""

    slope: Value = quantity("viscous", "change of the slope", nested=0.0)
    speed: Value = quantity("speed", "speed at which the slope changes", nested="guess")

    def torque_at(self, speed: Any) -> Any:
        """Return the torque at `speed` >= 0."""
        return self.slope * positive_part(speed - self.speed)


@dataclass(frozen=True)
class AddedFriction:
    """Terms that are added to the magnitude of a law, and shares that its own numbers are larger by.

    Any of them may differ by direction.
    """

    coulomb: Value = quantity("torque", "added Coulomb friction", None)
    viscous: Value = quantity("viscous", "added viscous friction", None)
    quadratic: Value = quantity("quadratic", "added quadratic friction", None)
    speed_share: Value = quantity("dimensionless", "share by which the Stribeck speed is larger", None, nested=0.0)
    stiffness_share: Value = quantity("dimensionless", "share by which the bristle is stiffer", None)
    damping_share: Value = quantity("dimensionless", "share by which the bristle's damping is larger", None)
    stribeck: StribeckRise | None = None
    bend: Bend | None = None

    def torque_at(self, speed: Any) -> Any:
        """Return the torque at `speed` >= 0."""
        plain = (self.coulomb, 1.0), (self.viscous, speed), (self.quadratic, speed * speed)
        torque: Any = 0.0 * speed
        for value, factor in plain:
            torque = torque if value is None else torque + value * factor
        for part in (self.stribeck, self.bend):
            torque = torque if part is None else torque + part.torque_at(speed)
        return torque

    def grown(self, name: str, value: Any) -> Any:
        """Return a number of the law by its name, `value`, larger by its share."""
        share = getattr(self, SHARES[name])
        return value if share is None else value * (1.0 + share)

    def changed(self, law: Law) -> Law:
        """Return the law with the Stribeck speed that it has beside these terms."""
        if self.speed_share is None:
            return law
        return replace(law, omega_s=self.grown("omega_s", getattr(law, "omega_s")))  # noqa: B009


@dataclass(frozen=True)
class Sum(AbstractFrictionLaw):
    """A static law and further terms."""

    law: AbstractFrictionLaw = inline()
    added: AddedFriction = AddedFriction()
    name: ClassVar[str] = "sum"

    def magnitude(self, speed: Any) -> Any:
        return self.added.changed(self.law).magnitude(speed) + self.added.torque_at(speed)

    def weakening(self, speed: Any) -> Any:
        return self.added.changed(self.law).weakening(speed)


@dataclass(frozen=True)
class BristleSum(AbstractBristleLaw):
    """A bristle law whose bristle also carries further terms."""

    law: AbstractBristleLaw = inline()
    added: AddedFriction = AddedFriction()
    name: ClassVar[str] = "bristle_sum"

    @property
    def sigma0(self) -> Any:
        """Bristle stiffness."""
        return self.added.grown("sigma0", getattr(self.law, "sigma0"))  # noqa: B009

    @property
    def sigma1(self) -> Any:
        """Bristle damping."""
        return self.added.grown("sigma1", getattr(self.law, "sigma1"))  # noqa: B009

    @property
    def sigma2(self) -> Any:
        """Viscous friction."""
        return getattr(self.law, "sigma2")  # noqa: B009

    def level(self, speed: Any) -> Any:
        return self.added.changed(self.law).level(speed) + self.added.torque_at(speed)

    def weakening(self, speed: Any) -> Any:
        return self.added.changed(self.law).weakening(speed)


@dataclass(frozen=True)
class BristleSprings(SpringShares):
    """Springs that slip, beside a bristle; each would slip after a travel of level / stiffness."""

    stiffness: Value = quantity("stiffness", "stiffness of the middle spring, did it carry all")

    def under(self, level: Any) -> tuple[Spring, ...]:
        """Return the springs under a level."""
        wholes = [factor * self.stiffness for factor in STIFFNESSES]
        return tuple(Spring(whole * share, level / whole) for whole, share in zip(wholes, self.shares, strict=True))


@dataclass(frozen=True)
class Bristle:
    """Elastic contact before breakaway."""

    sigma0: Value = quantity("stiffness", "bristle stiffness")
    sigma1: Value = quantity("damping", "bristle damping", 0.0)
    springs: BristleSprings | None = None


@dataclass(frozen=True)
class Bristled(AbstractBristleLaw):
    """A static law as the steady curve of a bristle; it becomes the static law as the bristle gets stiff.

    The bristle carries all of it but the viscous part, if the law has a field of that name.
    """

    law: AbstractFrictionLaw = inline()
    bristle: Bristle = Bristle(1.0)
    name: ClassVar[str] = "bristled"

    @property
    def deflections(self) -> tuple[str, ...]:
        return ("z", *(() if self.bristle.springs is None else self.bristle.springs.deflections))

    @property
    def carried(self) -> Any:
        return 1.0 if self.bristle.springs is None else self.bristle.springs.rest

    def springs(self, level: Any) -> tuple[Spring, ...]:
        return () if self.bristle.springs is None else self.bristle.springs.under(level)

    @property
    def sigma0(self) -> Any:
        """Bristle stiffness."""
        return self._grown("sigma0")

    @property
    def sigma1(self) -> Any:
        """Bristle damping."""
        return self._grown("sigma1")

    def _grown(self, name: str) -> Any:
        terms, value = added_terms(self.law), getattr(self.bristle, name)
        return value if terms is None else terms.grown(name, value)

    @property
    def sigma2(self) -> Any:
        """Viscous friction."""
        return viscous_part(self.law)

    def level(self, speed: Any) -> Any:
        return self.law.magnitude(speed) - viscous_part(self.law) * speed

    def weakening(self, speed: Any) -> Any:
        return self.law.weakening(speed)


def viscous_part(law: AbstractFrictionLaw) -> Any:
    """Return the viscous friction of a static law, 0 where it has none of that name."""
    return viscous_part(law.law) if isinstance(law, Sum) else getattr(law, "viscous", 0.0)


def with_added(law: AbstractFrictionLaw, **terms: Any) -> AbstractFrictionLaw:
    """Return a law with further terms; terms of the same name that it has already are replaced."""
    if isinstance(law, (Sum, BristleSum)):
        return replace(law, added=replace(law.added, **terms))
    if isinstance(law, Bristled):
        return replace(law, law=with_added(law.law, **terms))
    if isinstance(law, AbstractBristleLaw):
        return BristleSum(law, AddedFriction(**terms))
    return Sum(law, AddedFriction(**terms))


def with_bristle(law: AbstractFrictionLaw, bristle: Bristle) -> Bristled:
    """Return a static law as the steady curve of a bristle."""
    return Bristled(law, bristle)


def plain_law(law: AbstractFrictionLaw) -> AbstractFrictionLaw:
    """Return the law that was added to."""
    return plain_law(law.law) if isinstance(law, (Sum, BristleSum, Bristled)) else law


def added_terms(law: AbstractFrictionLaw) -> AddedFriction | None:
    """Return the terms that were added to a law."""
    if isinstance(law, Bristled):
        return added_terms(law.law)
    return law.added if isinstance(law, (Sum, BristleSum)) else None
