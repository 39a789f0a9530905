"""Optional parts of a part: a mapping whose keys are the fields of the term."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import lru_cache
from typing import Annotated, Any, cast, get_args, get_type_hints

from pydantic import PlainValidator, create_model

from friction_ocp.drive.parts import (
    Cogging,
    Disturbance,
    Eccentricity,
    ExternalTorque,
    Gravity,
    Hysteresis,
    KinematicError,
    SecondStage,
    TorqueRipple,
)
from friction_ocp.friction.modifiers import Ripple, WarmUp
from friction_ocp.problem_file.numbers import Number
from friction_ocp.problem_file.sections import Section, given


def _reader(term: type[Any]) -> Callable[[Any], Any]:
    """Return what reads a mapping into a term."""

    def read(value: Any) -> Any:
        if value is None:
            return None
        section = _section_of(term).model_validate(value)
        return term(**given(section, *section.keys()))

    return read


def _kind(field: dataclasses.Field[Any], hint: Any) -> Any:
    """Return what a key holds: a number, or the fields of a part."""
    if "kind" in field.metadata:
        return Number
    part = next(one for one in get_args(hint) if dataclasses.is_dataclass(one))
    return Annotated[Any, PlainValidator(_reader(cast(type[Any], part)))]


@lru_cache(maxsize=64)
def _section_of(term: type[Any]) -> type[Section]:
    fields = dataclasses.fields(term)
    hints = get_type_hints(term)
    keys: dict[str, Any] = {
        field.name: (_kind(field, hints[field.name]), ... if field.default is dataclasses.MISSING else field.default)
        for field in fields
    }
    return create_model(term.__name__, __base__=Section, **keys)


CoggingTerm = Annotated[Any, PlainValidator(_reader(Cogging))]
DisturbanceTerm = Annotated[Any, PlainValidator(_reader(Disturbance))]
EccentricityTerm = Annotated[Any, PlainValidator(_reader(Eccentricity))]
RippleTerm = Annotated[Any, PlainValidator(_reader(Ripple))]
TorqueRippleTerm = Annotated[Any, PlainValidator(_reader(TorqueRipple))]
WarmUpTerm = Annotated[Any, PlainValidator(_reader(WarmUp))]
SecondStageTerm = Annotated[Any, PlainValidator(_reader(SecondStage))]
HysteresisTerm = Annotated[Any, PlainValidator(_reader(Hysteresis))]
KinematicErrorTerm = Annotated[Any, PlainValidator(_reader(KinematicError))]
ExternalTorqueTerm = Annotated[Any, PlainValidator(_reader(ExternalTorque))]
GravityTerm = Annotated[Any, PlainValidator(_reader(Gravity))]
