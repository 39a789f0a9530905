"""The friction of a shaft: its keys are the fields of the law that it names."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from functools import lru_cache
from typing import Annotated, Any, ClassVar, cast, get_args, get_origin, get_type_hints

from pydantic import Field, create_model

from friction_ocp.expressions import closest
from friction_ocp.friction.composite import (
    SHARES,
    Bend,
    Bristle,
    BristleSprings,
    StribeckRise,
    with_added,
    with_bristle,
)
from friction_ocp.friction.element import FrictionElement, LoadDependence
from friction_ocp.friction.law import AbstractFrictionLaw
from friction_ocp.friction.registry import friction_laws
from friction_ocp.problem_file.numbers import FrictionNumber, FrictionNumbers
from friction_ocp.problem_file.sections import Fault, Section, given, refuse, shown
from friction_ocp.problem_file.term_sections import RippleTerm, WarmUpTerm


class LoadSection(Section):
    """Friction per transmitted torque."""

    coulomb: FrictionNumber = 0.0
    stribeck: FrictionNumber = 0.0
    viscous: FrictionNumber = 0.0
    omega_s: FrictionNumber = None

    def build(self) -> LoadDependence:
        return LoadDependence(**given(self, *type(self).model_fields))


class PartSection(Section):
    """Numbers that belong together within a law, such as one element of many."""

    part: ClassVar[type[Any]]

    def build(self) -> Any:
        return self.part(**given(self, *type(self).model_fields))


class StribeckRiseSection(Section):
    """Extra friction near standstill."""

    torque: FrictionNumber
    omega_s: FrictionNumber
    delta: FrictionNumber = 2.0
    tail: FrictionNumber = None


class BendSection(Section):
    """A change of the viscous slope."""

    slope: FrictionNumber
    speed: FrictionNumber


class AddedSection(Section):
    """Terms added to a law, and shares that its own numbers are larger by."""

    coulomb: FrictionNumber = None
    viscous: FrictionNumber = None
    quadratic: FrictionNumber = None
    speed_share: FrictionNumber = None
    stiffness_share: FrictionNumber = None
    damping_share: FrictionNumber = None
    stribeck: StribeckRiseSection | None = None
    bend: BendSection | None = None

    def build(self) -> dict[str, Any]:
        """Return the terms by name."""
        plain = (name for name in type(self).model_fields if name not in ("stribeck", "bend"))
        terms = dict(given(self, *plain))
        if self.stribeck is not None:
            terms["stribeck"] = StribeckRise(**given(self.stribeck, *StribeckRiseSection.model_fields))
        if self.bend is not None:
            terms["bend"] = Bend(self.bend.slope, self.bend.speed)
        return terms


class BristleSpringsSection(PartSection):
    """Springs that slip beside a bristle."""

    part: ClassVar[type[Any]] = BristleSprings

    share: FrictionNumber
    soft: FrictionNumber
    stiff: FrictionNumber
    stiffness: FrictionNumber


class BristleSection(Section):
    """Elastic contact under a static law."""

    sigma0: FrictionNumber
    sigma1: FrictionNumber = 0.0
    springs: BristleSpringsSection | None = None

    def build(self) -> Bristle:
        springs = None if self.springs is None else self.springs.build()
        return Bristle(self.sigma0, self.sigma1, springs)


class FrictionSection(Section):
    """What every law has beside its own numbers."""

    law: str
    load: LoadSection | None = None
    ripple: RippleTerm = None
    warm_up: WarmUpTerm = None
    added: AddedSection | None = None
    bristle: BristleSection | None = None

    @classmethod
    def keys(cls) -> list[str]:
        """Return the numbers of the law, then what every law may have; what only a diagnosis writes is left out."""
        every = super().keys()
        known = [name for name in every if name not in ("added", "bristle")]
        return sorted(known, key=lambda name: name in FrictionSection.model_fields)

    @classmethod
    def hint(cls, name: str) -> str:
        """Return the nearest key, else the laws that have this one and all that this law has."""
        own = set(cls.keys()) - set(FrictionSection.model_fields)
        wider = {law: {field.name for field in dataclasses.fields(kind)} for law, kind in friction_laws().items()}
        with_it = [law for law, keys in wider.items() if {name, *own} <= keys]
        return super().hint(name) or (f"the law {' or '.join(with_it)} has it" if with_it else "")

    def build(self, law: type[AbstractFrictionLaw]) -> FrictionElement:
        numbers = given(self, *(name for name in self.keys() if name not in FrictionSection.model_fields))
        whole: AbstractFrictionLaw = law(**{name: _built(value) for name, value in numbers.items()})
        if self.added is not None:
            whole = with_added(whole, **self.added.build())
            self._refuse_shares_of_nothing(law)
        if self.bristle is not None and not law.has_bristle:
            whole = with_bristle(whole, self.bristle.build())
        load = None if self.load is None else self.load.build()
        return FrictionElement(whole, load, self.ripple, self.warm_up)

    def _refuse_shares_of_nothing(self, law: type[AbstractFrictionLaw]) -> None:
        """Refuse shares that numbers are to be larger by which neither the law nor its bristle has."""
        there = {field.name for field in dataclasses.fields(law)}
        there |= set() if self.bristle is None else set(BristleSection.model_fields)
        remedy = "leave it out or take another law"
        faults = [
            Fault(("added", share), f"this friction has no {name} to be larger by a share", "", remedy)
            for name, share in SHARES.items()
            if getattr(self.added, share) is not None and name not in there
        ]
        if faults:
            raise refuse("friction", faults)


def read_friction(value: Any) -> FrictionElement:
    """Read the friction of a shaft by the law that it names."""
    if not isinstance(value, dict):
        what = f"this is {shown(value)}"
        raise refuse("friction", [Fault((), what, "a mapping such as {law: coulomb, tau_c: 0.1}")])
    laws = friction_laws()
    name = cast(Mapping[str, Any], value).get("law")
    if not isinstance(name, str) or name not in laws:
        what = f"unknown friction law {name!r}" if "law" in value else "this key is missing"
        fault = Fault(("law",), what, f"available: {', '.join(laws)}", closest(str(name), list(laws)))
        raise refuse("friction", [fault])
    return _section_of(laws[name]).model_validate(value).build(laws[name])


@lru_cache(maxsize=64)
def _section_of(law: type[AbstractFrictionLaw]) -> type[FrictionSection]:
    """Return the section whose keys are the fields of a law."""
    return create_model(law.__name__, __base__=FrictionSection, **_keys(law))


def _keys(part: type[Any]) -> dict[str, Any]:
    """Return type and default of every key that stands for a field of a law, or of a part of one."""
    hints = get_type_hints(part)
    keys: dict[str, Any] = {}
    for field in dataclasses.fields(part):
        hint = hints[field.name]
        several = get_origin(hint) is tuple
        if "kind" in field.metadata:
            default = ... if field.default is dataclasses.MISSING else field.default
            keys[field.name] = (FrictionNumbers if several else FrictionNumber, default)
        else:
            section = _section_of_part(get_args(hint)[0] if several else hint)
            keys[field.name] = (Annotated[list[section], Field(min_length=1)] if several else section, ...)
    return keys


@lru_cache(maxsize=64)
def _section_of_part(part: type[Any]) -> type[PartSection]:
    section = create_model(part.__name__, __base__=PartSection, **_keys(part))
    section.part = part
    return section


def _built(value: Any) -> Any:
    """Return the part of a law that a section stands for; numbers pass."""
    if isinstance(value, list):
        return tuple(_built(item) for item in cast("list[Any]", value))
    return value.build() if isinstance(value, PartSection) else value
