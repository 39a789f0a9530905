"""What all sections of a problem file share: their faults in the words of a person, and their names."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, cast

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    ModelWrapValidatorHandler,
    ValidationError,
    model_validator,
)
from pydantic_core import ErrorDetails, InitErrorDetails, PydanticCustomError

from friction_ocp.errors import Finding
from friction_ocp.expressions import closest

Location = tuple[int | str, ...]
NUMBER_FORMS = "a number, {guess, min, max, prior_std, prior_mean, scope} or {expr}"
_TYPES = {
    "float_type": "a number",
    "int_type": "a whole number",
    "string_type": "text",
    "bool_type": "true or false",
    "list_type": "a list",
    "tuple_type": "a list",
    "dict_type": "a mapping",
    "model_type": "a mapping",
    "finite_number": "a finite number",
}


@dataclass(frozen=True)
class Fault:
    """What is wrong at one place of the document."""

    location: Location
    what: str
    allowed: str = ""
    remedy: str = ""
    number: Location | None = None
    """Where the number stands that cannot be read because of it."""

    def finding(self, where: str) -> Finding:
        """Return the finding about the file `where`."""
        return Finding(f"{where}: {written(self.location)}", self.what, self.allowed, self.remedy)


def written(location: Location) -> str:
    """Return a location as people write it: drive.shafts[0].friction."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in location)
    return text.removeprefix(".")


def refuse(title: str, faults: Iterable[Fault]) -> ValidationError:
    """Return the error that carries faults through pydantic, which adds the location of the section."""
    return ValidationError.from_exception_data(title, [_carried(fault) for fault in faults])


def faults_of(error: ValidationError) -> list[Fault]:
    """Return the faults that pydantic found or carried."""
    return [_fault(details, None) for details in error.errors()]


def _carried(fault: Fault) -> InitErrorDetails:
    cut = -1 if fault.number is None else len(fault.location) - len(fault.number)
    context = {"what": fault.what, "allowed": fault.allowed, "remedy": fault.remedy, "cut": cut}
    return InitErrorDetails(type=PydanticCustomError("fault", "{what}", context), loc=fault.location, input=None)


def _fault(details: ErrorDetails, section: type[Section] | None) -> Fault:
    location, context = details["loc"], details.get("ctx", {})
    if details["type"] == "fault":
        cut = cast(int, context["cut"])
        number = None if cut < 0 else location[: len(location) - cut]
        return Fault(location, context["what"], context["allowed"], context["remedy"], number)
    number = () if section is not None and section.is_number else None
    if section is not None and details["type"] == "extra_forbidden":
        keys, name = section.keys(), str(location[-1])
        return Fault(location, f"unknown key '{name}'", f"available: {', '.join(keys)}", section.hint(name), number)
    if details["type"] == "missing":
        needed = section is not None and _holds_number(section, str(location[-1]))
        return Fault(
            location, "this key is missing", NUMBER_FORMS if needed else "", "", location if needed else number
        )
    return Fault(location, *_refused_value(details), "", number)


def _refused_value(details: ErrorDetails) -> tuple[str, str]:
    value, context = details["input"], details.get("ctx", {})
    if details["type"] == "literal_error":
        return f"unknown value {value!r}", f"available: {str(context['expected']).replace(' or ', ', ')}"
    if details["type"] in ("too_short", "too_long"):
        length, limit = context["actual_length"], context.get("min_length", context.get("max_length"))
        return f"the list has {length} items", f"at {'least' if 'min_length' in context else 'most'} {limit}"
    allowed = _TYPES.get(details["type"], details["msg"].replace("Input should be ", "").replace("Value error, ", ""))
    return f"this is {shown(value)}", allowed


def _holds_number(section: type[Section], name: str) -> bool:
    field = next((item for key, item in section.model_fields.items() if name in (key, item.alias)), None)
    return field is not None and any(isinstance(item, NumberMark) for item in field.metadata)


class Section(BaseModel):
    """A mapping of the file with the keys that its fields name, and no others."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)
    is_number: ClassVar[bool] = False
    """Whether the section is one way to write a number."""

    @classmethod
    def keys(cls) -> list[str]:
        """Return the keys that exist here."""
        return [field.alias or name for name, field in cls.model_fields.items()]

    @classmethod
    def hint(cls, name: str) -> str:
        """Return what was probably meant by a key that does not exist here."""
        return closest(name, cls.keys())

    @model_validator(mode="wrap")
    @classmethod
    def _tell_faults(cls, data: Any, handler: ModelWrapValidatorHandler[Any]) -> Any:
        try:
            return handler(data)
        except ValidationError as error:
            raise refuse(cls.__name__, [_fault(details, cls) for details in error.errors()]) from None


class NumberMark:
    """Marks fields that hold a number of the drive."""


def shown(value: Any) -> str:
    """Return a value as a finding names it."""
    if isinstance(value, dict):
        return "a mapping"
    return "a list" if isinstance(value, list) else "empty" if value is None else repr(value)


def _part_name(name: str) -> str:
    if not name or any(character in "./@" or character.isspace() for character in name):
        raise ValueError("a name without spaces and without . / @")
    if name == "reference":
        raise ValueError("another name: 'reference' is the set point of the controller")
    return name


def _channel_name(name: str) -> str:
    if not name or any(character in "/@" for character in name):
        raise ValueError("a name without / and @")
    return name


PartName = Annotated[str, AfterValidator(_part_name)]
ChannelName = Annotated[str, AfterValidator(_channel_name)]


def given(section: Section, *names: str) -> Mapping[str, Any]:
    """Return those of the named fields that the file states, for parts that have defaults of their own."""
    return {name: getattr(section, name) for name in names if name in section.model_fields_set}
