"""The friction of a shaft: its keys are the fields of the law that it names."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, cast, get_origin, get_type_hints

from pydantic import create_model

from friction_ocp.expressions import closest
from friction_ocp.friction.element import FrictionElement, LoadDependence
from friction_ocp.friction.law import AbstractFrictionLaw
from friction_ocp.friction.registry import friction_laws
from friction_ocp.problem_file.numbers import FrictionNumber, FrictionNumbers
from friction_ocp.problem_file.sections import Fault, Section, given, refuse, shown


class LoadSection(Section):
    """Friction per transmitted torque."""

    coulomb: FrictionNumber = 0.0
    stribeck: FrictionNumber = 0.0
    viscous: FrictionNumber = 0.0

    def build(self) -> LoadDependence:
        return LoadDependence(**given(self, *type(self).model_fields))


class FrictionSection(Section):
    """What every law has beside its own numbers."""

    law: str
    load: LoadSection | None = None

    def build(self, law: type[AbstractFrictionLaw]) -> FrictionElement:
        numbers = given(self, *(name for name in type(self).model_fields if name not in ("law", "load")))
        return FrictionElement(law(**numbers), None if self.load is None else self.load.build())


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
    hints = get_type_hints(law)
    keys: dict[str, Any] = {}
    for field in dataclasses.fields(law):
        if "kind" in field.metadata:
            several = get_origin(hints[field.name]) is tuple
            default = ... if field.default is dataclasses.MISSING else field.default
            keys[field.name] = (FrictionNumbers if several else FrictionNumber, default)
    return create_model(law.__name__, __base__=FrictionSection, **keys)
