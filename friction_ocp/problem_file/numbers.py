"""The ways to write a number of the drive: known, fitted, tied, or different by direction."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, cast

from pydantic import Field, PlainValidator, TypeAdapter

from friction_ocp.parameters import Directional, Free, Scope, Tie, Value
from friction_ocp.problem_file.sections import NUMBER_FORMS, Fault, NumberMark, Section, refuse, shown

UNREADABLE = object()
"""Stands in a document for a number that was refused, so that the rest can still be checked."""

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]


class FittedNumber(Section):
    """A number to be fitted."""

    is_number: ClassVar[bool] = True
    guess: Finite
    min: float = -math.inf
    max: float = math.inf
    prior_std: Positive | None = None
    prior_mean: Finite | None = None
    scope: Scope = "shared"

    def build(self) -> Free:
        return Free(self.guess, self.min, self.max, self.prior_std, self.prior_mean, self.scope)


class GuessedLevel(Section):
    """A level of noise to be estimated."""

    guess: Positive


def read_noise_level(value: Any) -> float | GuessedLevel | None:
    """Read a level of noise: known, to be estimated from a guess, or to be estimated (None)."""
    if value == "estimate":
        return None
    if isinstance(value, dict):
        return GuessedLevel.model_validate(value)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value) or value < 0:
        raise refuse("noise", [Fault((), f"this is {shown(value)}", "a number >= 0, estimate, or {guess: ...}")])
    return float(value)


NoiseNumber = Annotated[Any, PlainValidator(read_noise_level)]


class TiedNumber(Section):
    """A number computed from others."""

    is_number: ClassVar[bool] = True
    expr: str

    def build(self) -> Tie:
        return Tie(self.expr)


def read_number(value: Any) -> Value:
    """Read a number, a fitted number or a tie."""
    if value is UNREADABLE:
        return math.nan
    if isinstance(value, dict):
        return _number_of_mapping(cast(dict[str, Any], value))
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise refuse("number", [Fault((), f"this is {shown(value)}", NUMBER_FORMS, number=())])
    return float(value)


def _number_of_mapping(value: dict[str, Any]) -> Value:
    if "expr" in value:
        return TiedNumber.model_validate(value).build()
    if value.keys() & {"positive", "negative"}:
        what = "this number does not depend on the direction of motion"
        raise refuse("number", [Fault((), what, "only numbers of friction take {positive, negative}", number=())])
    return FittedNumber.model_validate(value).build()


def read_friction_number(value: Any) -> Value:
    """Read a number that may differ by the direction of motion."""
    if isinstance(value, dict) and value.keys() & {"positive", "negative"}:
        return DirectionalNumber.model_validate(value).build()
    return read_number(value)


def read_friction_numbers(value: Any) -> tuple[Value, ...]:
    """Read a list of numbers; `{positive: [...], negative: [...]}` becomes a list of directional ones."""
    if isinstance(value, dict):
        return DirectionalNumbers.model_validate(value).build()
    if not isinstance(value, list):
        raise refuse("numbers", [Fault((), f"this is {shown(value)}", "a list of numbers")])
    return tuple(_NUMBERS.validate_python(value))


Number = Annotated[Any, PlainValidator(read_number), NumberMark()]
FrictionNumber = Annotated[Any, PlainValidator(read_friction_number), NumberMark()]
FrictionNumbers = Annotated[Any, PlainValidator(read_friction_numbers)]
_NUMBERS: TypeAdapter[list[Any]] = TypeAdapter(list[FrictionNumber])


class DirectionalNumber(Section):
    """A number of friction that differs by the direction of motion."""

    positive: Number
    negative: Number

    def build(self) -> Directional:
        return Directional(self.positive, self.negative)


class DirectionalNumbers(Section):
    """Numbers of friction that differ by the direction of motion."""

    positive: list[Number]
    negative: list[Number]

    def build(self) -> tuple[Directional, ...]:
        if len(self.positive) != len(self.negative):
            what = f"there are {len(self.positive)} positive and {len(self.negative)} negative numbers"
            raise refuse("numbers", [Fault((), what, "as many in both directions")])
        return tuple(Directional(*pair) for pair in zip(self.positive, self.negative, strict=True))
